// The layers of a job's film in a real browser, and mixing of light groups:
//   node layers_test.mjs FOLDER-OF-PROGRAMS [--pictures FOLDER]
import assert from 'node:assert/strict';
import {cpSync, readFileSync, writeFileSync} from 'node:fs';
import {join} from 'node:path';
import {after, before, test} from 'node:test';
import {eventually, kSource} from './farm.mjs';
import {assertFits, kPhone, Session} from './session.mjs';

const [programs, ...options] = process.argv.slice(2);
const pictures = options[0] === '--pictures' ? options[1] : undefined;
const session = new Session(programs);
let page;
let job;

before(() => session.start());
after(() => session.close());

/** The box with its lamp and a spot as two groups. */
function twoLights() {
  const scene = JSON.parse(readFileSync(join(kSource, 'scenes/cornell-bench-blocks.json'), 'utf8'));
  scene.name = 'two lights';
  scene.materials.find(({name}) => name === 'lamp').light_group = 'lamp';
  scene.lights = [{name: 'spot', group: 'blue', spot: {position: [278, 500, 60], direction: [0, -1, 0.35], intensity: {rgb: [20000, 60000, 200000]}, cutoff_degrees: 35, blend: 0.4}}];
  const file = join(session.farm.folder, 'two-lights.json');
  writeFileSync(file, JSON.stringify(scene));
  cpSync(join(kSource, 'scenes/assets'), join(session.farm.folder, 'assets'), {recursive: true});
  return file;
}

/** R, G and B of the middle pixel, as the page shows them. */
async function middle() {
  await page.locator('.viewer canvas').focus();
  const box = await page.locator('.viewer canvas').boundingBox();
  await page.mouse.move(box.x + box.width / 2 + 1, box.y + box.height / 2);
  await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
  const values = await page.locator('.pixel dd').allTextContents();
  return values.slice(0, 3).map(Number);
}

/** The same, once all pixels of the layer have arrived. */
async function middleOf(layer, samples = '64') {
  await page.getByRole('combobox', {name: 'Layer'}).selectOption({label: layer});
  await eventually(`pixels of ${layer}`, async () => (await middle()) && (await page.locator('.pixel dd').allTextContents())[5] === samples);
  return middle();
}

const layerOf = (somePage) => somePage.getByRole('combobox', {name: 'Layer'});

const sumOf = (...values) => values[0].map((_, i) => values.reduce((sum, each) => sum + each[i], 0));

function assertNear(got, expected, what) {
  // Each value is rounded to a half, and shown with four digits.
  got.forEach((value, i) => assert.ok(Math.abs(value - expected[i]) <= 2e-3 * Math.abs(expected[i]) + 1e-6, `${what}: ${got} are not ${expected}`));
}

test('every layer is shown, and the parts of the light add up to the picture', async () => {
  const layers = 'direct,indirect,albedo,normal,depth,id,light:lamp,light:blue';
  job = session.farm.lightmill('submit', twoLights(), '--size', '160x160', '--spp', '64', '--layers', layers, '--method', 'path').trim();
  page = await session.open(`#/jobs/${job}`);
  await session.waitForState(job, 'DONE');
  const layer = layerOf(page);
  await layer.waitFor();
  const offered = await layer.locator('option').allTextContents();
  assert.deepEqual(offered, ['Beauty', 'Direct light', 'Indirect light', 'Albedo', 'Light: lamp', 'Light: blue', 'All other light', 'Normals', 'Depth']);
  const beauty = await middleOf('Beauty');
  assertNear(sumOf(await middleOf('Direct light'), await middleOf('Indirect light')), beauty, 'direct and indirect');
  assertNear(sumOf(await middleOf('Light: lamp'), await middleOf('Light: blue')), beauty, 'light groups');
  assert.deepEqual(await middleOf('All other light'), [0, 0, 0]);
  const normal = await middleOf('Normals');
  assert.ok(Math.abs(Math.hypot(...normal) - 1) < 2e-3, `${normal}`);
  // The back wall or a block, between the front of the box and its end.
  const [depth] = await middleOf('Depth');
  assert.ok(depth > 800 && depth < 1400, `${depth}`);
  await eventually('an exposure that fits', async () => Number(await page.getByLabel('Exposure in stops').inputValue()) < -8);
  if (pictures) {
    await page.screenshot({path: join(pictures, 'layer-depth.png')});
    await middleOf('Normals');
    await page.screenshot({path: join(pictures, 'layer-normals.png')});
  }
  await layer.selectOption({label: 'Beauty'});
  assert.equal(await page.getByLabel('Exposure in stops').inputValue(), '0');
});

test('light groups are mixed at once, and the link restores the mix', async () => {
  const [lamp, blue] = [await middleOf('Light: lamp'), await middleOf('Light: blue')];
  await page.getByRole('combobox', {name: 'Layer'}).selectOption({label: 'Beauty'});
  const panel = page.getByRole('region', {name: 'Light groups'});
  const drawn = async (expected, what) => eventually(what, async () => (await middle()).every((value, i) => Math.abs(value - expected[i]) <= 2e-3 * expected[i] + 1e-6));
  await panel.getByLabel('Light: blue: stops').fill('2');
  await drawn(sumOf(lamp, blue.map((value) => 4 * value)), 'four times the blue light');
  if (pictures) {
    await page.screenshot({path: join(pictures, 'relight.png')});
  }
  await panel.getByRole('checkbox', {name: 'Light: lamp'}).uncheck();
  await drawn(blue.map((value) => 4 * value), 'the blue light alone');
  await panel.getByLabel('Light: blue: colour').fill('#ff0000');
  await drawn([4 * blue[0], 0, 0], 'its red part');
  await eventually('the address follows', () => /relight=.*blue:2~ff0000/.test(page.url()) && /lamp:off/.test(page.url()));
  const again = page;
  page = await session.open(new URL(again.url()).hash);
  await page.waitForSelector('canvas[data-drawn]');
  await drawn([4 * blue[0], 0, 0], 'the same from the link');
  await page.getByRole('region', {name: 'Light groups'}).getByRole('button', {name: 'As rendered'}).click();
  await drawn(sumOf(lamp, blue), 'as it was rendered');
  await page.context().close();
  page = again;
});

test('a job with features shows its denoised picture, unless the raw one is chosen or errors are shown', async () => {
  const box = join(kSource, 'scenes/cornell-bench-blocks.json');
  const noisy = session.farm.lightmill('submit', box, '--size', '160x160', '--spp', '8', '--denoise', '--method', 'path').trim();
  const before = page;
  page = await session.open(`#/jobs/${noisy}`);
  await session.waitForState(noisy, 'DONE');
  const layer = layerOf(page);
  await layer.waitFor();
  assert.deepEqual(await layer.locator('option').allTextContents(), ['Beauty', 'Denoised']);
  assert.equal(await layer.inputValue(), 'denoised');
  const raw = await middleOf('Beauty', '8');
  await eventually('the address follows', () => page.url().includes('layer=beauty'));
  if (pictures) {
    await page.screenshot({path: join(pictures, 'layer-raw.png')});
  }
  await eventually('the denoised picture', async () => {
    const denoised = await middleOf('Denoised', '8');
    return denoised.some((value, i) => value !== raw[i]) && denoised.every((value, i) => value > raw[i] / 4 && value < 4 * raw[i]);
  });
  await eventually('the address follows', () => page.url().includes('layer=denoised'));
  if (pictures) {
    await page.screenshot({path: join(pictures, 'layer-denoised.png')});
  }
  await page.context().close();
  page = await session.open(`#/jobs/${noisy}`);
  await layerOf(page).waitFor();
  await page.getByRole('combobox', {name: 'Show'}).selectOption({label: 'Standard error'});
  assert.equal(await layerOf(page).inputValue(), '');
  await page.getByRole('combobox', {name: 'Show'}).selectOption({label: 'Colour'});
  assert.equal(await layerOf(page).inputValue(), 'denoised');
  await page.context().close();
  page = await session.open(`#/jobs/${noisy}?with=${job}`);
  await layerOf(page).waitFor();
  assert.equal(await layerOf(page).inputValue(), '', 'raw pictures are compared');
  await page.context().close();
  page = before;
});

test('a picture that is too large to be denoised is shown raw, without a failure', async () => {
  const large = session.farm.lightmill('submit', join(kSource, 'scenes/cornell-bench-blocks.json'), '--size', '2048x1025', '--seconds', '0.5', '--denoise', '--method', 'preview').trim();
  const before = page;
  page = await session.open(`#/jobs/${large}`);
  await layerOf(page).waitFor();
  await session.waitForState(large, 'DONE');
  await eventually('the raw picture', async () => (await layerOf(page).inputValue()) === '' && (await page.locator('canvas[data-drawn]').count()) === 1);
  assert.equal(await page.getByRole('alert').count(), 0);
  await layerOf(page).selectOption({label: 'Denoised'});
  await eventually('the reason', async () => /2099200 pixels/.test(await page.getByRole('alert').textContent()));
  await page.context().close();
  page = before;
});

test('the layers fit a phone and pass axe', async () => {
  for (const colorScheme of ['light', 'dark']) {
    const small = await session.open(`#/jobs/${job}?relight=blue:2`, {viewport: kPhone, colorScheme, bypassCSP: true});
    await small.waitForSelector('canvas[data-drawn]');
    await small.getByRole('region', {name: 'Light groups'}).waitFor();
    if (pictures) {
      await small.screenshot({path: join(pictures, `layers-phone-${colorScheme}.png`), fullPage: true});
    }
    await assertFits(small);
    await small.context().close();
  }
});

test('the page contacts only the coordinator and logs no error', () => session.assertQuiet());
