// The web page in a real browser against a real farm: node page_test.mjs FOLDER-OF-PROGRAMS [--picture FILE.png]
import assert from 'node:assert/strict';
import {readdirSync, readFileSync, statSync} from 'node:fs';
import {createRequire} from 'node:module';
import {join} from 'node:path';
import {after, before, test} from 'node:test';
import {eventually, Farm, kSource} from './farm.mjs';

const require = createRequire(join(kSource, 'client/web/package.json'));
const {chromium} = require('playwright-core');
const axe = readFileSync(require.resolve('axe-core/axe.min.js'), 'utf8');

const [programs, ...options] = process.argv.slice(2);
const picture = options[0] === '--picture' ? options[1] : undefined;
const kDesktop = {width: 1280, height: 860};
const kPhone = {width: 390, height: 844};

/** @type {Farm} */ let farm;
let browser;
let page;
let job;
const requests = [];
const faults = [];

async function open(path, {viewport = kDesktop, colorScheme = 'dark', ...more} = {}) {
  const context = await browser.newContext({viewport, colorScheme, acceptDownloads: true, ...more});
  const opened = await context.newPage();
  opened.setDefaultTimeout(20_000);
  opened.on('request', (request) => requests.push(request.url()));
  opened.on('pageerror', (error) => faults.push(error.message));
  opened.on('console', (message) => {
    if (message.type() === 'error' && !/WebSocket connection|Failed to load resource|ERR_CONNECTION/.test(message.text())) {
      faults.push(message.text());
    }
  });
  await opened.goto(farm.page + path);
  return opened;
}

/** The job in `state`, as the page's own API has it. */
const stateOf = async (id) => (await (await fetch(`${farm.page}api/v1/jobs/${id}`)).json()).state;
const waitForState = (id, state) => eventually(`job ${id} is ${state}`, async () => (await stateOf(id)) === `JOB_STATE_${state}`);

before(async () => {
  farm = new Farm(programs);
  await farm.startServer();
  farm.startWorker('box-1');
  browser = await chromium.launch({executablePath: '/usr/bin/chromium', args: ['--no-sandbox', '--enable-unsafe-swiftshader']});
});

after(async () => {
  await browser?.close();
  await farm?.close();
});

test('the page loads less than 300 KB of compressed script', () => {
  const assets = join(programs, 'lightmill-web/assets');
  const scripts = readdirSync(assets).filter((name) => name.endsWith('.js.gz'));
  assert.ok(scripts.length > 0);
  const bytes = scripts.reduce((sum, name) => sum + statSync(join(assets, name)).size, 0);
  assert.ok(bytes < 300_000, `${bytes} bytes`);
});

test('an empty farm says how to submit', async () => {
  page = await open('#/jobs');
  await page.getByText('lightmill submit').waitFor();
  await page.getByRole('status').getByText('live').waitFor();
});

test('a job that is submitted appears, and its picture sharpens to the pixels of the PNG', async () => {
  job = farm.submit('cornell-bench-blocks', '--spp', '32', '--size', '192x160', '--name', 'blocks in a box');
  await page.getByRole('link', {name: 'blocks in a box'}).click();
  await page.waitForSelector('canvas[data-drawn]');
  await page.getByText(/^±\S+% after/).waitFor();
  await waitForState(job, 'DONE');
  await page.locator('.job-head .badge', {hasText: 'done'}).waitFor();
  const file = join(farm.folder, 'box.png');
  farm.lightmill('fetch', job, '-o', file);
  const expected = await page.evaluate(pixelsOf, readFileSync(file).toString('base64'));
  await page.locator('canvas').first().focus();
  await page.keyboard.press('1');
  await eventually('the canvas shows the pixels of the PNG', async () => {
    const worst = await page.evaluate(worstDifference, {expected, width: 192, height: 160});
    // A half has 11 bits, and the two round in different places.
    return worst <= 1;
  }, 10_000);
});

/** In the browser: the RGBA bytes of a PNG. */
async function pixelsOf(base64) {
  const bytes = Uint8Array.from(atob(base64), (each) => each.charCodeAt(0));
  const bitmap = await createImageBitmap(new Blob([bytes], {type: 'image/png'}));
  const context = new OffscreenCanvas(bitmap.width, bitmap.height).getContext('2d');
  context.drawImage(bitmap, 0, 0);
  return [...context.getImageData(0, 0, bitmap.width, bitmap.height).data];
}

/** In the browser: in how many of their bytes two PNGs differ. */
async function differingShare(pngs) {
  const [a, b] = await Promise.all(
    pngs.map(async (base64) => {
      const bytes = Uint8Array.from(atob(base64), (each) => each.charCodeAt(0));
      const bitmap = await createImageBitmap(new Blob([bytes], {type: 'image/png'}));
      const context = new OffscreenCanvas(bitmap.width, bitmap.height).getContext('2d');
      context.drawImage(bitmap, 0, 0);
      return context.getImageData(0, 0, bitmap.width, bitmap.height).data;
    }),
  );
  let differing = 0;
  a.forEach((value, i) => (differing += value === b[i] ? 0 : 1));
  return a.length === b.length ? differing / a.length : 1;
}

/** In the browser: how far the middle of the viewer is from a picture, in steps of 8 bits. */
function worstDifference({expected, width, height}) {
  const canvas = document.querySelector('.viewer canvas');
  const gl = canvas.getContext('webgl2');
  const shown = new Uint8Array(4 * width * height);
  const [x, y] = [(canvas.width - width) / 2, (canvas.height - height) / 2];
  gl.readPixels(Math.round(x), Math.round(y), width, height, gl.RGBA, gl.UNSIGNED_BYTE, shown);
  let worst = 0;
  for (let row = 0; row < height; ++row) {
    for (let i = 0; i < 4 * width; ++i) {
      worst = Math.max(worst, Math.abs(shown[4 * width * (height - 1 - row) + i] - expected[4 * width * row + i]));
    }
  }
  return worst;
}

test('the pixel that is pointed at is told', async () => {
  const box = await page.locator('.viewer canvas').boundingBox();
  await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
  await page.getByText('96, 80').waitFor();
  const values = await page.locator('.pixel dd').allTextContents();
  assert.equal(values[5], '32');
  values.slice(0, 5).forEach((value) => assert.match(value, /^\d\.\d+/));
});

test('keys and controls change how it is shown, and the link brings that back', async () => {
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
  const again = await open(new URL(page.url()).hash);
  await again.waitForSelector('canvas[data-drawn]');
  assert.equal(await again.getByRole('combobox', {name: 'Show'}).inputValue(), 'relative-error');
  assert.equal(await again.getByLabel('Exposure in stops').inputValue(), '0.5');
  await eventually('the same picture', async () => {
    const pictures = [await canvas.screenshot(), await again.locator('.viewer canvas').screenshot()];
    const share = await page.evaluate(differingShare, pictures.map((each) => each.toString('base64')));
    // Where a pixel of the screen lies on the edge of two of the picture, rounding may choose the other.
    return share < 1 / 200;
  });
  await again.context().close();
});

test('every map draws without a fault', async () => {
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

test('the PNG that the page makes has the pixels of the command line', async () => {
  const [download] = await Promise.all([page.waitForEvent('download'), page.getByRole('button', {name: 'PNG'}).click()]);
  assert.equal(download.suggestedFilename(), `job-${job}.png`);
  const made = await page.evaluate(pixelsOf, readFileSync(await download.path()).toString('base64'));
  const expected = await page.evaluate(pixelsOf, readFileSync(join(farm.folder, 'box.png')).toString('base64'));
  assert.equal(made.length, expected.length);
  assert.ok(made.every((value, i) => Math.abs(value - expected[i]) <= 1));
});

test('a job is paused, resumed, extended and cancelled from the page', async () => {
  const other = farm.submit('cornell-bench-balls', '--spp', '100000', '--size', '256x256', '--method', 'path', '--name', 'balls');
  await page.goto(`${farm.page}#/jobs/${other}`);
  await page.getByRole('button', {name: 'Pause'}).click();
  await waitForState(other, 'PAUSED');
  await page.getByRole('button', {name: 'Resume'}).click();
  await waitForState(other, 'RUNNING');
  await page.getByLabel('New total of samples').fill('10');
  await page.getByRole('button', {name: 'Extend'}).click();
  await page.getByRole('alert').getByText('samples').waitFor();
  await page.getByLabel('New total of samples').fill('200000');
  await page.getByRole('button', {name: 'Extend'}).click();
  await page.getByText('200000 samples').waitFor();
  if (picture) {
    await page.waitForTimeout(12_000);
    await page.evaluate(() => document.querySelector('.side').scrollTo(0, 0));
    await page.mouse.move(520, 700);
    await page.waitForTimeout(500);
    await page.screenshot({path: picture});
  }
  page.once('dialog', (dialog) => dialog.accept());
  await page.getByRole('button', {name: 'Cancel'}).click();
  await waitForState(other, 'CANCELLED');
  await page.locator('.job-head .badge', {hasText: 'cancelled'}).waitFor();
});

test('jobs are found, filtered and opened by keys alone', async () => {
  await page.goto(`${farm.page}#/jobs`);
  await page.getByRole('row').nth(2).waitFor();
  await page.waitForFunction(() => [...document.querySelectorAll('.thumbnail img')].every((image) => image.naturalWidth > 0));
  await page.keyboard.press('/');
  await page.keyboard.type('blocks');
  await eventually('one job is left', async () => (await page.locator('tbody tr').count()) === 1);
  await page.keyboard.press('ArrowDown');
  await page.keyboard.press('Enter');
  await eventually('the job opens', () => page.url().endsWith(`#/jobs/${job}`));
  await page.goBack();
  await page.getByRole('button', {name: /^Failed/}).click();
  await page.getByRole('link', {name: 'balls'}).waitFor();
});

test('a lost connection shows, comes back by itself and catches up', async () => {
  await page.goto(`${farm.page}#/jobs`);
  await page.getByRole('button', {name: /^All/}).click();
  await farm.stop('server');
  await page.getByRole('alert').getByText('is lost').waitFor();
  await farm.startServer();
  const third = farm.submit('cornell-bench-blocks', '--spp', '4', '--size', '64x64', '--name', 'after the break');
  await page.getByRole('link', {name: 'after the break'}).waitFor();
  await page.getByRole('status').getByText('live').waitFor();
  assert.equal(await page.getByRole('alert').count(), 0);
  await waitForState(third, 'DONE');
});

test('nothing serious for axe, in light and dark, on a desktop and a phone', async () => {
  for (const [viewport, colorScheme] of [[kDesktop, 'light'], [kDesktop, 'dark'], [kPhone, 'light'], [kPhone, 'dark']]) {
    const opened = await open('#/jobs', {viewport, colorScheme, bypassCSP: true});
    for (const [hash, ready] of [['#/jobs', '.row-link'], [`#/jobs/${job}`, 'canvas[data-drawn]'], ['#/workers', 'tbody tr']]) {
      await opened.goto(farm.page + hash);
      await opened.waitForSelector(ready);
      await opened.evaluate(axe);
      const {violations} = await opened.evaluate(() => window.axe.run());
      const serious = violations.filter((each) => ['serious', 'critical'].includes(each.impact));
      const told = serious.map((each) => `${hash} ${colorScheme}: ${each.id}: ${each.nodes.map((node) => node.html).join(' | ')}`);
      assert.deepEqual(told, []);
      const wider = await opened.evaluate(() => document.documentElement.scrollWidth - window.innerWidth);
      assert.ok(wider <= 0, `${hash} is ${wider} pixels wider than the screen of ${viewport.width}`);
    }
    await opened.context().close();
  }
});

test('a worker is drained from the page', async () => {
  await page.goto(`${farm.page}#/workers`);
  page.once('dialog', (dialog) => dialog.accept());
  await page.getByRole('button', {name: 'Drain'}).click();
  await page.getByText('No workers').waitFor();
});

test('the page asked nobody but the coordinator, and complained of nothing', () => {
  const others = requests.filter((url) => !url.startsWith(farm.page) && !url.startsWith('blob:'));
  assert.deepEqual(others, []);
  assert.deepEqual(faults, []);
});
