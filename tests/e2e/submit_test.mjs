// Scenes dropped on the page in a real browser become jobs of a real farm:
//   node submit_test.mjs FOLDER-OF-PROGRAMS [--pictures FOLDER]
import assert from 'node:assert/strict';
import {cpSync, mkdirSync, readFileSync, writeFileSync} from 'node:fs';
import {join} from 'node:path';
import {after, before, test} from 'node:test';
import {eventually, kSource} from './farm.mjs';
import {assertFits, kPhone, Session} from './session.mjs';

const [programs, ...options] = process.argv.slice(2);
const pictures = options[0] === '--pictures' ? options[1] : undefined;
const session = new Session(programs);
const kScene = join(kSource, 'scenes/cornell-bench-blocks.json');
const kAssets = ['CornellBox.obj', 'CornellBlocks.obj'].map((name) => join(kSource, 'scenes/assets', name));
let page;

before(async () => {
  await session.start();
  await eventually('the worker is there', async () => (await api('workers')).workers?.length === 1);
});
after(() => session.close());

const api = async (path) => (await fetch(`${session.farm.page}api/v1/${path}`)).json();
const shownJob = () => /#\/jobs\/(\d+)/.exec(page.url())?.[1];
const panel = () => page.getByRole('region', {name: /^Submit a scene/});
const uploads = (since) => session.requests.slice(since).filter((url) => /assets\/[0-9a-f]{64}$/.test(url));

/** Drops files like a file manager: by name and content, without folders. */
async function drop(files) {
  const texts = files.map(({name, text}) => [name, Buffer.from(text).toString('base64')]);
  const dropped = await page.evaluateHandle((each) => {
    const transfer = new DataTransfer();
    each.forEach(([name, base64]) => transfer.items.add(new File([Uint8Array.from(atob(base64), (byte) => byte.charCodeAt(0))], name)));
    return transfer;
  }, texts);
  await page.locator('.drop-zone').dispatchEvent('drop', {dataTransfer: dropped});
}

const named = (path) => ({name: path.slice(path.lastIndexOf('/') + 1), text: readFileSync(path)});

async function fill(label, value) {
  await panel().getByLabel(label, {exact: true}).fill(value);
  await panel().getByLabel(label, {exact: true}).press('Tab');
}

test('a dropped scene with its files is sent, inspected and submitted', async () => {
  page = await session.open('#/jobs');
  await page.getByRole('status').getByText('live').waitFor();
  const since = session.requests.length;
  // The file that the scene names as assets/CornellBox.obj is dropped beside it.
  await drop([kScene, ...kAssets].map(named));
  await panel().getByRole('heading', {name: 'The scene'}).waitFor();
  assert.equal(uploads(since).length, 3);
  const methods = await panel().locator('.verdicts strong').allTextContents();
  assert.ok(methods.includes('path') && methods.length > 2, `${methods}`);
  assert.ok((await panel().locator('.findings dt').count()) > 2);
  assert.equal(await panel().getByLabel('Width').inputValue(), '512');
  if (pictures) {
    await page.screenshot({path: join(pictures, 'submit.png'), fullPage: true});
  }
  await fill('Name', 'dropped');
  await fill('Width', '96');
  await fill('Height', '80');
  await fill('Method', 'path');
  await fill('Samples', '16');
  await panel().getByRole('button', {name: 'Submit', exact: true}).click();
  await eventually('the page goes to the job', () => shownJob());
  await page.getByRole('heading', {name: 'dropped'}).waitFor();
  await page.waitForSelector('canvas[data-drawn]');
  const job = shownJob();
  await session.waitForState(job, 'DONE');
  // The same job as from the command line.
  const other = session.farm.submit('cornell-bench-blocks', '--size', '96x80', '--method', 'path', '--spp', '16', '--denoise');
  await session.waitForState(other, 'DONE');
  assert.equal((await api(`jobs/${job}`)).render_digest, (await api(`jobs/${other}`)).render_digest);
});

test('files of a chosen folder that the farm has are not sent again', async () => {
  const folder = join(session.farm.folder, 'scene-folder');
  mkdirSync(join(folder, 'assets'), {recursive: true});
  cpSync(kScene, join(folder, 'room.json'));
  kAssets.forEach((path) => cpSync(path, join(folder, 'assets', named(path).name)));
  writeFileSync(join(folder, 'notes.txt'), 'no part of it');
  await page.goto(`${session.farm.page}#/jobs`);
  const since = session.requests.length;
  await page.getByLabel("A scene's folder").setInputFiles(folder);
  await panel().getByRole('heading', {name: 'The scene'}).waitFor();
  await panel().getByText('Left out, because no scene names them: 1 file').waitFor();
  assert.deepEqual(uploads(since), []);
  assert.equal(await panel().getByLabel('Name', {exact: true}).inputValue(), 'cornell-bench-blocks');
  await panel().getByRole('button', {name: 'Close'}).click();
  assert.equal(await panel().count(), 0);
});

test('a fault in a scene is shown with its place and what to do', async () => {
  await drop([{name: 'broken.json', text: '{"name": "broken", "camera": {"eye": [0, 0, 5], "look_at": [0, 0, 0]}}'}]);
  await panel().getByRole('alert').getByText('camera').waitFor();
  await panel().getByRole('button', {name: 'Try again'}).waitFor();
  await drop([{name: 'notes.txt', text: 'hello'}]);
  await panel().getByRole('alert').getByText('None of these files is a scene').waitFor();
  await drop([named(kScene)]);
  await panel().getByRole('alert').getByText('CornellB').waitFor();
  await panel().getByRole('button', {name: 'Close'}).click();
});

test('a cancelled upload resumes where it stopped', async () => {
  let held;
  await page.route(/assets\/[0-9a-f]{64}$/, async (route) => {
    await new Promise((resolve) => (held = resolve));
    await route.continue().catch(() => undefined);
  });
  const scene = JSON.stringify({...JSON.parse(readFileSync(kScene, 'utf8')), name: 'another'});
  await drop([{name: 'another.json', text: scene}, ...kAssets.map(named)]);
  await eventually('it is being sent', () => held);
  await panel().getByText(/^Sending/).waitFor();
  await panel().getByRole('button', {name: 'Cancel'}).click();
  await panel().getByRole('alert').getByText('Cancelled').waitFor();
  held();
  await page.unroute(/assets\/[0-9a-f]{64}$/);
  await panel().getByRole('button', {name: 'Try again'}).click();
  await panel().getByRole('heading', {name: 'The scene'}).waitFor();
  await panel().getByRole('button', {name: 'Close'}).click();
});

test('a browser that cannot hash says what to do instead', async () => {
  const here = page;
  page = await here.context().newPage();
  // Like a page loaded over plain HTTP from another machine.
  await page.addInitScript(() => Object.defineProperty(Crypto.prototype, 'subtle', {get: () => undefined}));
  await page.goto(`${session.farm.page}#/jobs`);
  await drop([named(kScene)]);
  await panel().getByRole('alert').getByText('over https').waitFor();
  await page.close();
  page = here;
});

test('the panel fits a phone and passes axe', async () => {
  for (const [viewport, colorScheme] of [[undefined, 'light'], [undefined, 'dark'], [kPhone, 'light'], [kPhone, 'dark']]) {
    page = await session.open('#/jobs', {...(viewport && {viewport}), colorScheme, bypassCSP: true});
    await drop([kScene, ...kAssets].map(named));
    await panel().getByRole('heading', {name: 'The scene'}).waitFor();
    if (pictures) {
      await page.screenshot({path: join(pictures, `submit-${viewport ? 'phone' : 'desktop'}-${colorScheme}.png`), fullPage: true});
    }
    await assertFits(page);
    await page.context().close();
  }
});

test('the page contacts only the coordinator and logs no error', () => session.assertQuiet());
