// Overlays of the picture, the photon map and the scene's meters:
//   node light_test.mjs FOLDER-OF-PROGRAMS [--pictures FOLDER]
import assert from 'node:assert/strict';
import {cpSync, readFileSync, writeFileSync} from 'node:fs';
import {join} from 'node:path';
import {after, before, test} from 'node:test';
import {eventually, kSource} from './farm.mjs';
import {canvasPixels, pixelsOf} from './pixels.mjs';
import {assertFits, kPhone, Session} from './session.mjs';

const [programs, ...options] = process.argv.slice(2);
const pictures = options[0] === '--pictures' ? options[1] : undefined;
const session = new Session(programs);
const kSide = 160;
let page;
let job;

before(() => session.start());
after(() => session.close());

/** The box with a meter on its lamp, one on its floor, a patch of that and the flux through it. */
function measuredBox() {
  const scene = JSON.parse(readFileSync(join(kSource, 'scenes/cornell-bench-blocks.json'), 'utf8'));
  const floor = {corner: [350, 1, 50], edge1: [0, 0, 100], edge2: [100, 0, 0]};
  scene.meters = [
    {name: 'lamp', irradiance: {point: [278, 548, 279.5], normal: [0, -1, 0]}},
    {name: 'floor', irradiance: {point: [400, 1, 100], normal: [0, 1, 0]}},
    {name: 'patch', patch: floor},
    {name: 'flux', flux: {patch: floor}},
    {name: 'behind', irradiance: {point: [278, 273, -900], normal: [0, 0, 1]}},
  ];
  const file = join(session.farm.folder, 'measured-box.json');
  writeFileSync(file, JSON.stringify(scene));
  cpSync(join(kSource, 'scenes/assets'), join(session.farm.folder, 'assets'), {recursive: true});
  return file;
}

const canvas = () => page.evaluate(canvasPixels, {width: kSide, height: kSide});
const jobsNamed = async (ending) => {
  const {jobs} = await (await fetch(`${session.farm.page}api/v1/jobs`)).json();
  return (jobs ?? []).filter(({name}) => name.endsWith(ending)).length;
};

test('the meters show the readings of the command line at their places', async () => {
  job = session.farm.lightmill('submit', measuredBox(), '--size', `${kSide}x${kSide}`, '--spp', '32', '--method', 'path').trim();
  page = await session.open(`#/jobs/${job}`);
  await session.waitForState(job, 'DONE');
  const table = Object.fromEntries(
    session.farm
      .lightmill('show', job)
      .split('\n')
      .map((line) => /^meter\s+(\S+): (.*)$/.exec(line.trim()))
      .filter((found) => found)
      .map(([, name, reading]) => [name, reading.split(', ')]),
  );
  assert.deepEqual(Object.keys(table), ['lamp', 'floor', 'patch', 'flux', 'behind']);
  await page.reload();
  for (const [name, [radiometric, photometric]] of Object.entries(table)) {
    await eventually(`the reading of ${name}`, async () => (await page.locator('.meters div', {hasText: name}).locator('dd').textContent()) === `${photometric} · ${radiometric}`);
  }
  // All are drawn, except the one behind the camera.
  assert.deepEqual(await page.locator('.meter-marks text').allTextContents(), ['lamp', 'floor', 'patch', 'flux'].map((name) => `${name} ${table[name][1]}`));
  const mark = await page.locator('.meter-marks circle').first().boundingBox();
  const view = await page.locator('.viewer canvas').boundingBox();
  await page.mouse.move(mark.x + mark.width / 2, mark.y + mark.height / 2);
  // Only the lamp is so bright.
  await eventually('the lamp below its meter', async () => Number((await page.locator('.pixel dd').allTextContents())[0]) > 5);
  assert.ok(mark.y < view.y + view.height / 2);
  if (pictures) {
    await page.screenshot({path: join(pictures, 'meters.png')});
  }
  await page.getByLabel('over the picture').uncheck();
  assert.equal(await page.locator('.meter-marks').count(), 0);
  await eventually('a link without them', () => page.url().includes('meters=off'));
  await assertFits(page);
});

test('the meters stay while their job ends, and show its last readings at once', async () => {
  const ending = session.farm.lightmill('submit', measuredBox(), '--size', `${kSide}x${kSide}`, '--spp', '100000', '--method', 'path').trim();
  const watching = await session.open(`#/jobs/${ending}`);
  await watching.locator('.meters').waitFor();
  await watching.evaluate(() => {
    const look = () => {
      if (!document.querySelector('.meters')) {
        document.body.dataset.metersWent = 'yes';
      }
    };
    new MutationObserver(look).observe(document.body, {childList: true, subtree: true});
  });
  assert.equal(await session.stateOf(ending), 'JOB_STATE_RUNNING');
  session.farm.lightmill('cancel', ending);
  await session.waitForState(ending, 'CANCELLED');
  const [, photometric] = /^meter\s+floor: \S.*, (.*)$/m.exec(session.farm.lightmill('show', ending));
  await eventually('the last reading', async () => (await watching.locator('.meters div', {hasText: 'floor'}).locator('dd').textContent()).startsWith(photometric));
  assert.equal(await watching.evaluate(() => document.body.dataset.metersWent), undefined);
  await watching.context().close();
});

test('photons are drawn at the pixels of a photon job, and leave nothing behind', async () => {
  const reference = session.farm.lightmill('submit', measuredBox(), '--size', `${kSide}x${kSide}`, '--spp', '1', '--method', 'photon-map:photons=10000').trim();
  await session.waitForState(reference, 'DONE');
  await page.locator('.viewer canvas').focus();
  await page.keyboard.press('1');
  const before = await canvas();
  await page.getByRole('combobox', {name: 'Photon map'}).selectOption({label: '10,000'});
  const after = await eventually('photons over the picture', async () => {
    const now = await canvas();
    return now.some((value, i) => value !== before[i]) && now;
  });
  const png = Buffer.from(await (await fetch(`${session.farm.page}api/v1/jobs/${reference}/picture.png`)).arrayBuffer());
  const photons = await page.evaluate(pixelsOf, png.toString('base64'));
  let covered = 0;
  for (let i = 0; i < photons.length; i += 4) {
    const strongest = Math.max(...after.slice(i, i + 3));
    if (Math.max(...photons.slice(i, i + 3)) > 0) {
      ++covered;
      assert.equal(strongest, 255, `a photon at ${(i / 4) % kSide}, ${Math.floor(i / 4 / kSide)}`);
    } else {
      // The picture is dimmed to four tenths.
      after.slice(i, i + 3).forEach((value, c) => assert.ok(Math.abs(value - 0.4 * before[i + c]) <= 1, `${value} of ${before[i + c]} at ${i / 4}`));
    }
  }
  assert.ok(covered > 1_000 && covered < (kSide * kSide) / 2, `${covered} pixels have photons`);
  assert.equal(await jobsNamed('(photon map)'), 1);
  await eventually('a link with them', () => page.url().includes('photons=few'));
  if (pictures) {
    await page.keyboard.press('f');
    await page.screenshot({path: join(pictures, 'photons.png')});
  }
  await page.getByRole('combobox', {name: 'Photon map'}).selectOption({label: 'None'});
  await eventually('no job of them is left', async () => (await jobsNamed('(photon map)')) === 0);
  await eventually('the picture as it was', async () => (await page.keyboard.press('1'), (await canvas()).every((value, i) => value === before[i])));
});

test('a phone shows photons from the link', async () => {
  const phone = await session.open(`#/jobs/${job}?photons=many`, {viewport: kPhone, colorScheme: 'light'});
  await eventually('its job', async () => (await jobsNamed('(photon map)')) === 1);
  await eventually('its picture', () => phone.evaluate(() => document.querySelector('.viewer canvas')?.dataset.drawn === 'yes'));
  await assertFits(phone);
  if (pictures) {
    await new Promise((resolve) => setTimeout(resolve, 2_000));
    await phone.screenshot({path: join(pictures, 'photons-phone.png')});
  }
  await phone.close({runBeforeUnload: false});
  await eventually('no job of them is left', async () => (await jobsNamed('(photon map)')) === 0);
});

test('the page contacts only the coordinator and logs no error', () => session.assertQuiet());
