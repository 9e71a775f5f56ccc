// Editing, cloning, prioritising and deleting jobs in a real browser with a real farm:
//   node edit_test.mjs FOLDER-OF-PROGRAMS [--pictures FOLDER]
import assert from 'node:assert/strict';
import {readFileSync, writeFileSync} from 'node:fs';
import {join} from 'node:path';
import {after, before, test} from 'node:test';
import {eventually, kSource} from './farm.mjs';
import {canvasPixels} from './pixels.mjs';
import {assertFits, kPhone, Session} from './session.mjs';

const [programs, ...options] = process.argv.slice(2);
const pictures = options[0] === '--pictures' ? options[1] : undefined;
const session = new Session(programs);
const kSize = ['--size', '96x80', '--method', 'path', '--spp', '16'];
/** Position of the scene's camera. */
const kEye = [278, 273, -800];
const kLookAt = [278, 273, 0];
let page;
let job;

before(async () => {
  await session.start();
  job = session.farm.submit('cornell-bench-blocks', ...kSize, '--name', 'blocks in a box');
  await session.waitForState(job, 'DONE');
});
after(() => session.close());

const api = async (path) => (await fetch(`${session.farm.page}api/v1/${path}`)).json();
const jobsThere = async () => (await api('jobs')).jobs;
const livePictures = async () => (await jobsThere()).filter((each) => each.name.endsWith('(being edited)'));
const shownJob = () => /#\/jobs\/(\d+)/.exec(page.url())?.[1];
const panel = () => page.getByRole('region', {name: 'Edit & render again'});
const field = (name) => panel().getByLabel(name, {exact: true});
const point = (name) => Promise.all(['x', 'y', 'z'].map(async (axis) => Number(await field(`${name} ${axis}`).inputValue())));
const near = (a, b) => a.every((value, i) => Math.abs(value - b[i]) < 1e-3 * Math.max(1, Math.abs(b[i])));
const digestOf = async (id) => (await api(`jobs/${id}`)).render_digest;

async function open(id) {
  await page.goto(`${session.farm.page}#/jobs/${id}`);
  await page.locator('.job-head').getByText(`#${id}`).waitFor();
  await page.getByRole('button', {name: 'Edit & render again'}).waitFor();
}

async function nextJob(before) {
  return eventually('the page goes to the new job', () => shownJob() !== String(before) && shownJob());
}

test('a clone is the same job with a new goal', async () => {
  page = await session.open(`#/jobs/${job}`);
  await page.getByRole('button', {name: 'Clone'}).click();
  const form = page.getByRole('region', {name: 'Clone'});
  await form.getByLabel('Name').fill('once more');
  await form.getByLabel('Samples').fill('8');
  await form.getByLabel('Samples').press('Tab');
  await form.getByRole('button', {name: 'Submit the clone'}).click();
  const clone = await nextJob(job);
  await page.getByRole('heading', {name: 'once more'}).waitFor();
  await session.waitForState(clone, 'DONE');
  assert.equal((await api(`jobs/${clone}`)).goal.samples, '8');
  // Everything that determines the samples is the same.
  assert.equal(await digestOf(clone), await digestOf(job));
});

test('one live picture shows the newest edit', async () => {
  await open(job);
  await page.waitForSelector('canvas[data-drawn]');
  await page.getByRole('button', {name: 'Edit & render again'}).click();
  await panel().waitFor();
  assert.ok(near(await point('Position'), kEye));
  const [first] = await eventually('a small job of it', async () => (await livePictures()).length === 1 && livePictures());
  assert.equal(first.parent, job);
  assert.equal(first.method, 'raycast');
  await eventually('its picture is shown', async () => (await livePictures())[0]?.state === 'JOB_STATE_DONE');
  const seen = await page.evaluate(canvasPixels, {width: 96, height: 80});
  let most = 0;
  const canvas = await page.locator('.viewer canvas').boundingBox();
  const middle = [canvas.x + canvas.width / 2, canvas.y + canvas.height / 2];
  await page.mouse.move(...middle);
  await page.mouse.down();
  for (let i = 1; i <= 20; ++i) {
    await page.mouse.move(middle[0] + 6 * i, middle[1] + 2 * i);
    await page.waitForTimeout(60);
    most = Math.max(most, (await livePictures()).length);
  }
  await page.mouse.up();
  await eventually('another took its place', async () => {
    const there = await livePictures();
    most = Math.max(most, there.length);
    return there.length === 1 && there[0].id !== first.id && there[0].state === 'JOB_STATE_DONE';
  });
  assert.equal(most, 1);
  const [x, y, z] = await point('Position');
  // The scene follows the mouse to the right and down. So the camera moves up and to the left, which is +x for a view along +z.
  assert.ok(x > 400 && y > 300, `${[x, y, z]}`);
  assert.ok(Math.abs(Math.hypot(x - 278, y - 273, z) / 800 - 1) < 1e-4, 'at the same distance');
  await eventually('the picture is another', async () => {
    const now = await page.evaluate(canvasPixels, {width: 96, height: 80});
    return now.some((value, i) => Math.abs(value - seen[i]) > 32);
  });
  if (pictures) {
    await page.waitForTimeout(500);
    await page.screenshot({path: join(pictures, 'edit.png')});
  }
});

test('an edit is undone and redone at once', async () => {
  const moved = await point('Position');
  await page.getByRole('button', {name: 'Undo'}).click();
  assert.ok(near(await point('Position'), kEye), 'one drag is one edit');
  await page.locator('.viewer canvas').focus();
  await page.keyboard.press('Control+Shift+Z');
  assert.ok(near(await point('Position'), moved));
  await page.getByRole('button', {name: 'Reset'}).click();
  assert.ok(near(await point('Position'), kEye));
});

test('keys turn, move and zoom the camera by known amounts', async () => {
  await page.locator('.viewer canvas').focus();
  await page.keyboard.press('ArrowRight');
  const angle = 0.03 * Math.PI;
  // Counter-clockwise seen from above, around the target.
  assert.ok(near(await point('Position'), [278 - 800 * Math.sin(angle), 273, -800 * Math.cos(angle)]), `${await point('Position')}`);
  await page.getByRole('button', {name: 'Undo'}).click();
  await page.locator('.viewer canvas').focus();
  await page.keyboard.press('+');
  assert.ok(near(await point('Position'), [278, 273, -800 / 1.1]));
  await page.getByRole('button', {name: 'Reset'}).click();
  await page.locator('.viewer canvas').focus();
  await page.keyboard.press('Shift+ArrowUp');
  const up = 0.03 * 2 * 800 * Math.tan((39.3077 * Math.PI) / 360);
  assert.ok(near(await point('Position'), [278, 273 + up, -800]));
  assert.ok(near(await point('Look at'), [278, 273 + up, 0]));
  await page.getByRole('button', {name: 'Reset'}).click();
  assert.ok(near(await point('Look at'), kLookAt));
});

test('a changed job becomes a child that reuses every asset and equals the job of the command line', async () => {
  await field('Position z').fill('-700');
  await field('Position z').press('Tab');
  await page.getByText(/^Materials/).click();
  await page.locator('.slot-group summary', {hasText: 'red'}).click();
  const red = page.getByRole('group', {name: 'red: Colour'});
  for (const [channel, value] of [['R', '0.1'], ['G', '0.2'], ['B', '0.6']]) {
    await red.getByLabel(`Colour ${channel}`).fill(value);
    await red.getByLabel(`Colour ${channel}`).press('Tab');
  }
  await page.getByText('Settings', {exact: true}).click();
  await field('Name').fill('blue wall');
  const before = session.requests.length;
  await page.getByRole('button', {name: 'Render', exact: true}).click();
  const child = await nextJob(job);
  await page.getByRole('heading', {name: 'blue wall'}).waitFor();
  await page.waitForSelector('canvas[data-drawn]');
  await session.waitForState(child, 'DONE');
  assert.deepEqual(session.requests.slice(before).filter((url) => url.includes('/assets')), []);
  assert.equal((await api(`jobs/${child}`)).parent, job);
  await eventually('no live picture is left', async () => (await livePictures()).length === 0);

  const scene = JSON.parse(readFileSync(join(kSource, 'scenes/cornell-bench-blocks.json'), 'utf8'));
  scene.camera.eye[2] = -700;
  scene.materials.find(({name}) => name === 'red').diffuse.reflectance.rgb = [0.1, 0.2, 0.6];
  scene.objects.forEach(({mesh}) => (mesh.file = join(kSource, 'scenes', mesh.file)));
  const file = join(session.farm.folder, 'changed.json');
  writeFileSync(file, JSON.stringify(scene));
  const same = session.farm.lightmill('submit', file, ...kSize).trim();
  await session.waitForState(same, 'DONE');
  const film = async (id) => {
    const picture = join(session.farm.folder, `${id}.png`);
    session.farm.lightmill('fetch', id, '-o', picture);
    return readFileSync(picture);
  };
  assert.ok((await film(child)).equals(await film(same)));
  assert.notEqual(await digestOf(child), await digestOf(job));
});

test('parent and child name each other', async () => {
  const child = shownJob();
  await page.getByRole('link', {name: `blocks in a box #${job}`}).click();
  await eventually('the parent is shown', () => shownJob() === job);
  await page.getByRole('link', {name: `blue wall #${child}`}).waitFor();
});

test('an invalid change is refused with its reason, and the next change works', async () => {
  await open(job);
  await page.getByRole('button', {name: 'Edit & render again'}).click();
  await field('Look at z').fill('-800');
  await field('Look at z').press('Tab');
  await panel().getByRole('alert').getByText('No live picture').waitFor();
  await page.getByRole('button', {name: 'Undo'}).click();
  await eventually('it is taken back', async () => (await panel().getByRole('alert').count()) === 0);
});

test('no live picture outlives the panel or the page', async () => {
  await eventually('a live picture is there', async () => (await livePictures()).length === 1);
  await panel().getByRole('button', {name: 'Close'}).click();
  await eventually('it is gone with the panel', async () => (await livePictures()).length === 0);
  // The page closes while a preview request is on its way to the farm.
  const asked = page.waitForRequest((request) => request.method() === 'POST' && request.url().includes('/jobs?page='));
  await page.getByRole('button', {name: 'Edit & render again'}).click();
  await asked;
  await page.goto('about:blank');
  await eventually('it is gone with the page', async () => (await livePictures()).length === 0);
  // The browser ends it without a message.
  const crashing = await session.open(`#/jobs/${job}`);
  await crashing.getByRole('button', {name: 'Edit & render again'}).click();
  await eventually('another is there', async () => (await livePictures())[0]?.state === 'JOB_STATE_DONE');
  await crashing.goto('chrome://crash').catch(() => undefined);
  await eventually('it is gone with the crash', async () => (await livePictures()).length === 0);
  await crashing.context().close();
});

test('priorities are set, and ended jobs are deleted after a confirmation', async () => {
  const long = session.farm.submit('cornell-bench-balls', '--spp', '100000', '--size', '128x128', '--method', 'path', '--name', 'balls');
  page = await session.open(`#/jobs/${long}`);
  await page.getByLabel('Priority', {exact: true}).fill('7');
  await page.getByLabel('Priority', {exact: true}).press('Tab');
  await eventually('the farm has it', async () => (await api(`jobs/${long}`)).priority === 7);
  assert.equal(await page.getByRole('button', {name: 'Delete'}).count(), 0);
  page.once('dialog', (dialog) => dialog.accept());
  await page.getByRole('button', {name: 'Cancel'}).click();
  await page.getByRole('button', {name: 'Delete'}).waitFor();
  page.once('dialog', (dialog) => dialog.dismiss());
  await page.getByRole('button', {name: 'Delete'}).click();
  assert.equal(await session.stateOf(long), 'JOB_STATE_CANCELLED');
  page.once('dialog', (dialog) => dialog.accept());
  await page.getByRole('button', {name: 'Delete'}).click();
  await page.getByRole('heading', {name: 'Jobs'}).waitFor();
  await eventually('it is gone', async () => !(await jobsThere()).some(({id}) => id === long));
  await eventually('the list has it no longer', async () => (await page.getByRole('link', {name: 'balls'}).count()) === 0);
});

test('the panels fit a phone and pass axe', async () => {
  for (const [viewport, colorScheme] of [[undefined, 'light'], [undefined, 'dark'], [kPhone, 'light'], [kPhone, 'dark']]) {
    const opened = await session.open(`#/jobs/${job}`, {...(viewport && {viewport}), colorScheme, bypassCSP: true});
    await opened.getByRole('button', {name: 'Clone'}).click();
    await opened.getByRole('button', {name: 'Submit the clone'}).waitFor();
    const check = async (what) => {
      if (pictures) {
        await opened.waitForTimeout(300);
        await opened.screenshot({path: join(pictures, `${what}-${viewport ? 'phone' : 'desktop'}-${colorScheme}.png`), fullPage: true});
      }
      await assertFits(opened, what);
    };
    await check('clone');
    await opened.getByRole('button', {name: 'Edit & render again'}).click();
    await opened.getByText(/^Materials/).click();
    await opened.locator('.slot-group summary').first().click();
    await opened.locator('.slot-group summary', {hasText: 'lamp'}).click();
    await opened.getByText('Settings', {exact: true}).click();
    await eventually('its live picture', async () => (await livePictures())[0]?.state === 'JOB_STATE_DONE');
    await check('edit');
    await opened.getByRole('region', {name: 'Edit & render again'}).getByRole('button', {name: 'Close'}).click();
    await eventually('no live picture is left', async () => (await livePictures()).length === 0);
    await opened.context().close();
  }
});

test('the page contacts only the coordinator and logs no error', () => session.assertQuiet());
