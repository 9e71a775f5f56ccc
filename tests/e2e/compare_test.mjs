// Comparison and measurement of pictures in a real browser with a real farm:
//   node compare_test.mjs FOLDER-OF-PROGRAMS [--pictures FOLDER]
import assert from 'node:assert/strict';
import {join} from 'node:path';
import {after, before, test} from 'node:test';
import {eventually} from './farm.mjs';
import {canvasPixels} from './pixels.mjs';
import {Session} from './session.mjs';

const [programs, ...options] = process.argv.slice(2);
const pictures = options[0] === '--pictures' ? options[1] : undefined;
const session = new Session(programs);
const kSize = {width: 96, height: 80};
let page;
let job;
let reference;

before(async () => {
  await session.start();
  const size = `${kSize.width}x${kSize.height}`;
  job = session.farm.submit('cornell-bench-blocks', '--spp', '8', '--size', size, '--method', 'path', '--name', 'few samples');
  reference = session.farm.submit('cornell-bench-blocks', '--spp', '128', '--size', size, '--method', 'path', '--seed', '7', '--name', 'many samples');
  session.farm.submit('cornell-bench-blocks', '--spp', '1', '--size', '64x64', '--name', 'another size');
  await session.waitForState(job, 'DONE');
  await session.waitForState(reference, 'DONE');
  for (const id of [job, reference]) {
    session.farm.lightmill('fetch', id, '-o', join(session.farm.folder, `${id}.exr`));
  }
});
after(() => session.close());

const compareBox = () => page.getByRole('combobox', {name: 'Compare with'});
const howBox = () => page.getByRole('combobox', {name: 'Comparison'});
/** The panel's values, by name. */
const measured = async () => Object.fromEntries((await page.locator('.measured > div').evaluateAll((all) => all.map((each) => [each.children[0].textContent, Number(each.children[1].textContent)]))));
const measuredAs = (what, condition) => eventually(what, async () => condition(await measured()));
const shown = () => page.evaluate(canvasPixels, kSize);
const takePicture = async (name) => pictures && (await page.screenshot({path: join(pictures, `${name}.png`)}));

/** Values of `lightmill error`. */
function errorOf(image, truth) {
  return JSON.parse(session.farm.lightmill('error', join(session.farm.folder, `${image}.exr`), join(session.farm.folder, `${truth}.exr`), '--json'));
}

function nearly(value, expected, share, what) {
  assert.ok(Math.abs(value - expected) <= share * expected, `${what}: ${value} for ${expected}`);
}

test('a comparison with a job of the same size has the numbers of the command line', async () => {
  page = await session.open(`#/jobs/${job}`);
  await page.waitForSelector('canvas[data-drawn]');
  await page.locator('.viewer canvas').focus();
  await page.keyboard.press('1');
  const offered = await eventually('the other job is offered', async () => {
    const all = await compareBox().locator('option').allTextContents();
    return all.some((each) => each.includes('many samples')) && all;
  });
  assert.ok(!offered.some((each) => each.includes('another size') || each.includes('few samples')));
  await compareBox().selectOption(reference);
  const expected = errorOf(job, reference);
  await measuredAs('the numbers are there', (each) => each.FLIP > 0);
  const numbers = await measured();
  // The page has half floats, each within 2^-11 of its value, and four digits. FLIP grows with the root of small differences.
  nearly(numbers.relMSE, expected.rel_mse, 2e-3, 'relMSE');
  nearly(numbers['relMSE without the worst 0.1%'], expected.rel_mse_trimmed, 2e-3, 'trimmed');
  nearly(numbers['Energy ratio'], expected.energy_ratio, 2e-3, 'energy');
  nearly(numbers.SMAPE, expected.smape, 2e-3, 'SMAPE');
  nearly(numbers.FLIP, expected.flip, 5e-3, 'FLIP');
  await howBox().selectOption('hdr-flip');
  await measuredAs('HDR-FLIP is there', (each) => each['HDR-FLIP'] > 0);
  nearly((await measured())['HDR-FLIP'], expected.flip_hdr, 5e-3, 'HDR-FLIP');
});

test('split shows both pictures, and keys and the mouse move the divider', async () => {
  await howBox().selectOption('picture');
  const here = await shown();
  await page.locator('.viewer canvas').focus();
  await page.keyboard.press('b');
  await eventually('the other is shown', async () => (await howBox().inputValue()) === 'other');
  const there = await shown();
  assert.notDeepEqual(here, there);
  await page.keyboard.press('b');
  assert.deepEqual(await shown(), here);
  await page.keyboard.press('s');
  const sides = async () => {
    const both = await shown();
    const column = (from, x) => Array.from({length: kSize.height}, (_, y) => from.slice(4 * (y * kSize.width + x), 4 * (y * kSize.width + x) + 4)).flat();
    return [0, kSize.width - 1].map((x) => [column(both, x), column(here, x), column(there, x)]);
  };
  const [[left, leftHere], [right, , rightThere]] = await sides();
  assert.deepEqual([left, right], [leftHere, rightThere]);
  await page.getByRole('separator').focus();
  await page.keyboard.press('Home');
  await eventually('all is the other', async () => JSON.stringify(await shown()) === JSON.stringify(there));
  const box = await page.locator('.viewer').boundingBox();
  await page.mouse.move(box.x + 2, box.y + 40);
  await page.mouse.down();
  await page.mouse.move(box.x + 0.75 * box.width, box.y + 60, {steps: 4});
  await page.mouse.up();
  await eventually('the divider follows', async () => (await page.getByRole('separator').getAttribute('aria-valuenow')) === '75');
  await page.locator('.viewer canvas').focus();
  await page.keyboard.press('[');
  await eventually('the link has it', () => new RegExp(`with=${reference}&how=split&split=0.7`).test(page.url()));
  await page.keyboard.press('f');
  await takePicture('split');
  await page.keyboard.press('1');
});

test('every comparison is drawn, and the link restores it', async () => {
  const seen = new Set();
  for (const [key, how] of [['d', 'difference'], ['q', 'squared-error'], ['p', 'flip']]) {
    await page.keyboard.press(key);
    await eventually(`${how} is shown`, async () => (await howBox().inputValue()) === how);
    const picture = await shown();
    assert.equal(await page.evaluate(() => document.querySelector('.viewer canvas').getContext('webgl2').getError()), 0, how);
    seen.add(JSON.stringify(picture));
    await takePicture(how);
  }
  assert.equal(seen.size, 3);
  await eventually('the address follows', () => page.url().includes('how=flip'));
  const again = await session.open(new URL(page.url()).hash);
  await again.locator('.measured dd').first().waitFor();
  const expected = await shown();
  await eventually('the same map', async () => JSON.stringify(await again.evaluate(canvasPixels, kSize)) === JSON.stringify(expected));
  await again.context().close();
});

test('an EXR file of the farm equals the picture, and a file of another size is refused', async () => {
  const [chooser] = await Promise.all([page.waitForEvent('filechooser'), compareBox().selectOption('file')]);
  await chooser.setFiles(join(session.farm.folder, `${job}.exr`));
  // Both went through the same rounding to half floats.
  await measuredAs('the file is the job', (each) => each.relMSE === 0 && each.FLIP === 0);
  await page.getByLabel('An EXR file to compare with').setInputFiles(join(session.farm.folder, `${reference}.exr`));
  const expected = errorOf(job, reference);
  await measuredAs('the numbers are those of the command line', (each) => Math.abs(each.relMSE / expected.rel_mse - 1) < 2e-3);
  await page.getByLabel('An EXR file to compare with').setInputFiles({name: 'notes.exr', mimeType: 'image/x-exr', buffer: Buffer.from('no picture')});
  await page.getByRole('alert').getByText('notes.exr: this is not an EXR file').waitFor();
  const other = await session.open(`#/jobs/${job}?with=3`);
  await other.getByRole('alert').getByText('another size #3 has 64×64 pixels, this picture 96×80').waitFor();
  await other.context().close();
});

test('a region is measured by mouse, by keys and by numbers', async () => {
  await page.goto(`${session.farm.page}#/jobs/${job}?zoom=4&x=48&y=40`);
  await page.reload();
  await page.waitForSelector('canvas[data-drawn]');
  const box = await page.locator('.viewer canvas').boundingBox();
  const at = (x, y) => [box.x + box.width / 2 + 4 * (x - 48), box.y + box.height / 2 + 4 * (y - 40)];
  await page.getByRole('button', {name: 'Region', exact: true}).click();
  await page.mouse.move(...at(10.5, 20.5));
  await page.mouse.down();
  await page.mouse.move(...at(29.5, 34.5), {steps: 4});
  await page.mouse.up();
  const fields = () => Promise.all(['Left', 'Top', 'Width', 'Height'].map(async (name) => Number(await page.locator('.region-fields').getByLabel(name).inputValue())));
  await eventually('the region is there', async () => (await fields()).join() === '10,20,20,15');
  await takePicture('region');
  await page.locator('.viewer canvas').focus();
  await page.keyboard.press('ArrowRight');
  await page.keyboard.press('Shift+ArrowDown');
  assert.deepEqual(await fields(), [12, 20, 20, 17]);
  await page.locator('.region-fields').getByLabel('Width').fill('1');
  await page.locator('.region-fields').getByLabel('Height').fill('1');
  await page.keyboard.press('Enter');
  await eventually('it is one pixel', async () => (await fields()).join() === '12,20,1,1');
  const means = await page.locator('.region-table tbody tr').first().locator('td').allTextContents();
  await page.mouse.move(...at(12.5, 20.5));
  await page.getByText('12, 20').waitFor();
  assert.deepEqual(means, (await page.locator('.pixel dd').allTextContents()).slice(0, 4));
  await eventually('the link has it', () => page.url().includes('region=12,20,1,1'));
  await page.locator('.viewer canvas').focus();
  await page.keyboard.press('Escape');
  await eventually('it is gone', async () => (await page.locator('.region-fields').count()) === 0);
});

test('the page contacts only the coordinator and logs no error', () => session.assertQuiet());
