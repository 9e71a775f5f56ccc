// One job's picture in a real browser with a real farm: node picture_test.mjs FOLDER-OF-PROGRAMS
import assert from 'node:assert/strict';
import {readFileSync} from 'node:fs';
import {join} from 'node:path';
import {after, before, test} from 'node:test';
import {eventually} from './farm.mjs';
import {differingShare, pixelsOf, worstDifference} from './pixels.mjs';
import {Session} from './session.mjs';

const session = new Session(process.argv[2]);
let page;
let job;

before(() => session.start());
after(() => session.close());

test('the picture of a submitted job sharpens to the pixels of the PNG', async () => {
  page = await session.open('#/jobs');
  job = session.farm.submit('cornell-bench-blocks', '--spp', '32', '--size', '192x160', '--name', 'blocks in a box');
  await page.getByRole('link', {name: 'blocks in a box'}).click();
  await page.waitForSelector('canvas[data-drawn]');
  await page.getByText(/^±\S+% after/).waitFor();
  await session.waitForState(job, 'DONE');
  await page.locator('.job-head .badge', {hasText: 'done'}).waitFor();
  const file = join(session.farm.folder, 'box.png');
  session.farm.lightmill('fetch', job, '-o', file);
  const expected = await page.evaluate(pixelsOf, readFileSync(file).toString('base64'));
  await page.locator('canvas').first().focus();
  await page.keyboard.press('1');
  await eventually('the canvas shows the pixels of the PNG', async () => {
    const worst = await page.evaluate(worstDifference, {expected, width: 192, height: 160});
    // A half has 11 bits, and the two sides round at different places.
    return worst <= 1;
  });
});

test('the page shows the values of the pixel under the mouse', async () => {
  const box = await page.locator('.viewer canvas').boundingBox();
  await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
  await page.getByText('96, 80').waitFor();
  const values = await page.locator('.pixel dd').allTextContents();
  assert.equal(values[5], '32');
  values.slice(0, 5).forEach((value) => assert.match(value, /^\d\.\d+/));
});

test('keys and controls change the view, and the link restores it', async () => {
  const canvas = page.locator('.viewer canvas');
  const before = await canvas.screenshot();
  await canvas.focus();
  for (const key of ['e', 'e', 'Shift+E', 'v', '+', 'ArrowLeft']) {
    await page.keyboard.press(key);
  }
  await page.getByRole('combobox', {name: 'Show'}).selectOption('relative-error');
  // No ring around the picture.
  await page.evaluate(() => document.activeElement.blur());
  await eventually('the address follows', () => /exposure=0\.5.*view=filmic.*show=relative-error.*zoom=/.test(page.url()));
  await eventually('the picture changes', async () => !(await canvas.screenshot()).equals(before));
  const again = await session.open(new URL(page.url()).hash);
  await again.waitForSelector('canvas[data-drawn]');
  assert.equal(await again.getByRole('combobox', {name: 'Show'}).inputValue(), 'relative-error');
  assert.equal(await again.getByLabel('Exposure in stops').inputValue(), '0.5');
  await eventually('the same picture', async () => {
    const pictures = [await canvas.screenshot(), await again.locator('.viewer canvas').screenshot()];
    const share = await page.evaluate(differingShare, pictures.map((each) => each.toString('base64')));
    // Where a screen pixel lies on the edge of two picture pixels, rounding may choose either.
    return share < 1 / 200;
  });
  // Also in the same tab, and back.
  await again.evaluate(() => (location.hash = location.hash.replace('exposure=0.5', 'exposure=-2')));
  const shown = (exposure) => eventually(`exposure ${exposure}`, async () => (await again.getByLabel('Exposure in stops').inputValue()) === exposure);
  await shown('-2');
  await again.goBack();
  await shown('0.5');
  await again.context().close();
});

/** The camera in a page's link: zoom and middle. */
function cameraOf(shown) {
  const parameters = new URLSearchParams(new URL(shown.url()).hash.split('?')[1]);
  return ['zoom', 'x', 'y'].map((name) => Number(parameters.get(name)));
}

async function assertCamera(shown, what, expected) {
  const near = (got) => got.every((value, i) => Math.abs(value - expected[i]) <= 1e-4 * expected[i]);
  await eventually(`${what}: ${expected}`, () => near(cameraOf(shown))).catch((error) => {
    throw new Error(`${error.message}, but ${cameraOf(shown)}`);
  });
}

/** Screen position of the picture's middle. */
function middleOf(shown) {
  return shown.locator('.viewer canvas').evaluate((canvas) => {
    const {x, y} = canvas.getBoundingClientRect();
    return {x: x + canvas.clientWidth / 2, y: y + canvas.clientHeight / 2};
  });
}

test('the wheel zooms about the mouse, and a drag moves the picture by its length', async () => {
  const shown = await session.open(`#/jobs/${job}?zoom=2&x=90&y=70`);
  await shown.waitForSelector('canvas[data-drawn]');
  const exact = await middleOf(shown);
  // Whole pixels, because wheel events have no others.
  const middle = {x: Math.round(exact.x), y: Math.round(exact.y)};
  const [dx, dy] = [middle.x + 40 - exact.x, middle.y - 20 - exact.y];
  await shown.mouse.move(middle.x + 40, middle.y - 20);
  await shown.mouse.wheel(0, -400);
  // The point under the mouse stays there while the picture grows e times.
  await assertCamera(shown, 'nearer', [2 * Math.E, 90 + (dx / 2) * (1 - 1 / Math.E), 70 + (dy / 2) * (1 - 1 / Math.E)]);
  await shown.mouse.wheel(0, 400);
  await assertCamera(shown, 'back', [2, 90, 70]);
  await shown.mouse.down();
  await shown.mouse.move(middle.x + 10, middle.y + 4, {steps: 3});
  await shown.mouse.up();
  await assertCamera(shown, 'dragged by 30 and 24 to the left and down', [2, 105, 58]);
  await shown.context().close();
});

test('two fingers move and zoom the picture', async () => {
  const shown = await session.open(`#/jobs/${job}?zoom=1&x=96&y=80`, {hasTouch: true});
  await shown.waitForSelector('canvas[data-drawn]');
  const exact = await middleOf(shown);
  const [x, y] = [Math.round(exact.x), Math.round(exact.y)];
  const middle = [exact.x - x, exact.y - y];
  const fingers = await shown.context().newCDPSession(shown);
  const touch = (type, ...points) => fingers.send('Input.dispatchTouchEvent', {type, touchPoints: points.map(([dx, dy], id) => ({x: x + dx, y: y + dy, id}))});
  await touch('touchStart', [-40, 0]);
  await touch('touchStart', [-40, 0], [40, 0]);
  await touch('touchMove', [-80, 0], [80, 0]);
  // The picture's points stay under the fingers: twice the zoom, about the point between them.
  const nearer = [96 - middle[0] / 2, 80 - middle[1] / 2];
  await assertCamera(shown, 'pinched', [2, ...nearer]);
  await touch('touchMove', [-60, 30], [100, 30]);
  await assertCamera(shown, 'moved', [2, nearer[0] - 10, nearer[1] - 15]);
  await touch('touchEnd');
  await shown.context().close();
});

test('every map is drawn without an error', async () => {
  const seen = new Set();
  for (const show of await page.getByRole('combobox', {name: 'Show'}).locator('option').evaluateAll((all) => all.map((each) => each.value))) {
    await page.getByRole('combobox', {name: 'Show'}).selectOption(show);
    await page.evaluate(() => new Promise((resolve) => requestAnimationFrame(() => requestAnimationFrame(resolve))));
    const error = await page.evaluate(() => document.querySelector('.viewer canvas').getContext('webgl2').getError());
    assert.equal(error, 0, show);
    seen.add((await page.locator('.viewer canvas').screenshot()).toString('base64'));
  }
  assert.equal(seen.size, 9);
  await page.locator('.viewer canvas').focus();
  await page.keyboard.press('r');
  await page.keyboard.press('f');
});

test('the PNG from the page has the pixels of the command line', async () => {
  const [download] = await Promise.all([page.waitForEvent('download'), page.getByRole('button', {name: 'PNG'}).click()]);
  assert.equal(download.suggestedFilename(), `job-${job}.png`);
  const made = await page.evaluate(pixelsOf, readFileSync(await download.path()).toString('base64'));
  const expected = await page.evaluate(pixelsOf, readFileSync(join(session.farm.folder, 'box.png')).toString('base64'));
  assert.equal(made.length, expected.length);
  assert.ok(made.every((value, i) => Math.abs(value - expected[i]) <= 1));
});

test('the page contacts only the coordinator and logs no error', () => session.assertQuiet());
