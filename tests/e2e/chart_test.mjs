// Charts of several jobs in a real browser with a real farm: node chart_test.mjs FOLDER-OF-PROGRAMS [--pictures FOLDER]
import assert from 'node:assert/strict';
import {readFileSync, writeFileSync} from 'node:fs';
import {join} from 'node:path';
import {after, before, test} from 'node:test';
import {eventually, kSource} from './farm.mjs';
import {assertFits, kPhone, Session} from './session.mjs';

const [programs, ...options] = process.argv.slice(2);
const pictures = options[0] === '--pictures' ? options[1] : undefined;
const session = new Session(programs);
const kLongName = 'a name without an end '.repeat(9).trim().replaceAll(' ', '_');
/** Messages that a page may get after it has said that it is hidden (ViewRequest.seen). */
const kOnTheirWay = 2;
let page;
let first;
let second;

before(async () => {
  await session.start();
  const size = ['--spp', '128', '--size', '96x80'];
  first = session.farm.submit('cornell-bench-blocks', ...size, '--method', 'path', '--name', 'by path');
  second = session.farm.submit('cornell-bench-blocks', ...size, '--method', 'vcm', '--name', kLongName);
  await session.waitForState(first, 'DONE');
  await session.waitForState(second, 'DONE');
});
after(() => session.close());

const historyOf = async (id) => (await (await fetch(`${session.farm.page}api/v1/jobs/${id}`)).json()).history;

async function kept(name) {
  const [download] = await Promise.all([page.waitForEvent('download'), page.getByRole('button', {name, exact: true}).click()]);
  return [download.suggestedFilename(), readFileSync(await download.path(), 'utf8')];
}

test('a second job appears in the same chart and in the link', async () => {
  page = await session.open(`#/jobs/${first}`);
  const lines = page.getByRole('list', {name: 'Jobs in the chart'}).getByRole('listitem');
  await eventually('the job is in its chart', async () => (await lines.count()) === 1);
  await page.getByRole('combobox', {name: 'Add a job to the chart'}).selectOption(second);
  await eventually('both are there', async () => (await lines.count()) === 2);
  await eventually('the link has it', () => page.url().includes(`chart=${second}`));
  await lines.nth(1).getByText('vcm').waitFor();
});

test('the mouse and keys show the values of a point', async () => {
  const plot = page.getByRole('img', {name: /^Error against time/});
  await plot.focus();
  await page.keyboard.press('ArrowRight');
  const values = () => page.locator('.chart-value').allTextContents();
  await eventually('both jobs have values', async () => (await values()).every((each) => / at /.test(each)));
  const [before] = await values();
  for (let i = 0; i < 30; ++i) {
    await page.keyboard.press('ArrowRight');
  }
  await eventually('the last point is another', async () => (await values())[0] !== before);
  const last = (await historyOf(first)).at(-1).error.rel_mse;
  const [shown] = await values();
  assert.ok(Math.abs(Number.parseFloat(shown) / last - 1) < 1e-3, `${shown} for ${last}`);
  const box = await plot.boundingBox();
  await page.mouse.move(box.x + 80, box.y + 60);
  await eventually('the mouse has its own', async () => (await values())[0] === before);
});

test('CSV has the values of the farm', async () => {
  const [name, csv] = await kept('CSV');
  assert.equal(name, `job-${first}-error.csv`);
  const rows = csv.trim().split('\n').slice(1).map((row) => row.split(','));
  for (const [id, method] of [[first, 'path'], [second, 'vcm']]) {
    const expected = (await historyOf(id)).filter((each) => each.error?.rel_mse > 0).map((each) => [each.worker_seconds, each.error.rel_mse]);
    const found = rows.filter((row) => row[1] === method).map((row) => [Number(row[2]), Number(row[3])]);
    assert.ok(expected.length > 2);
    assert.deepEqual(found.slice(0, expected.length), expected);
  }
});

test('a missing job is reported, and the other jobs are shown', async () => {
  const other = await session.open(`#/jobs/${first}?chart=777,${second}`);
  await other.getByRole('alert').getByText('Job 777 is not in the chart: there is no job 777').waitFor();
  await eventually('the others are there', async () => (await other.locator('.chart-lines li').count()) === 2);
  await other.context().close();
});

test('long names, comparisons, regions and charts fit a phone and pass axe', async () => {
  for (const colorScheme of ['light', 'dark']) {
    const phone = await session.open(`#/jobs/${second}?with=${first}&how=split&region=10,10,20,20&chart=${first}`, {viewport: kPhone, colorScheme, bypassCSP: true});
    await phone.locator('.measured dd').first().waitFor();
    await phone.locator('.region-table').waitFor();
    await eventually('the chart is there', async () => (await phone.locator('.chart-lines li').count()) === 2);
    if (pictures) {
      await phone.screenshot({path: join(pictures, `phone-${colorScheme}.png`), fullPage: true});
    }
    await assertFits(phone);
    await phone.context().close();
  }
  if (pictures) {
    await page.screenshot({path: join(pictures, 'chart.png')});
  }
});

test('a hidden page receives nothing, and catches up when it is visible', async () => {
  const hidden = await session.browser.newContext();
  const [opened, seen] = [await hidden.newPage(), await hidden.newPage()];
  const framesOf = (page) => {
    const received = {count: 0};
    page.on('websocket', (socket) => socket.on('framereceived', () => ++received.count));
    return received;
  };
  const [frames, framesSeen] = [framesOf(opened), framesOf(seen)];
  await opened.addInitScript(() => {
    window.isHidden = false;
    Object.defineProperty(Document.prototype, 'hidden', {get: () => window.isHidden});
    window.setHidden = (now) => {
      window.isHidden = now;
      document.dispatchEvent(new Event('visibilitychange'));
    };
  });
  await opened.goto(`${session.farm.page}#/jobs`);
  await opened.getByRole('link', {name: 'by path'}).waitFor();
  const running = session.farm.submit('cornell-bench-blocks', '--spp', '100000', '--size', '96x80', '--method', 'path', '--name', 'running');
  await opened.goto(`${session.farm.page}#/jobs/${running}`);
  await opened.waitForSelector('canvas[data-drawn]');
  const before = frames.count;
  await eventually('a running job sends', () => frames.count > before + 2);
  await opened.evaluate(() => window.setHidden(true));
  const most = frames.count + kOnTheirWay;
  const fourth = session.farm.submit('cornell-bench-blocks', '--spp', '1', '--size', '64x64', '--name', 'meanwhile');
  await seen.goto(`${session.farm.page}#/jobs`);
  await seen.getByRole('link', {name: 'meanwhile'}).waitFor();
  await seen.goto(`${session.farm.page}#/jobs/${running}`);
  await seen.waitForSelector('canvas[data-drawn]');
  const shown = framesSeen.count;
  await eventually('a page that is seen is sent the picture', () => framesSeen.count > shown + 10);
  assert.ok(frames.count <= most, `${frames.count} frames, at most ${most}`);
  await opened.evaluate(() => window.setHidden(false));
  await eventually('it is sent what it missed', () => frames.count > most);
  await opened.goto(`${session.farm.page}#/jobs/${fourth}`);
  await opened.getByRole('heading', {name: 'meanwhile'}).waitFor();
  session.farm.lightmill('cancel', running);
  await hidden.close();
});

test('dropped results of a lab show their methods in one chart', async () => {
  const folder = join(session.farm.folder, 'lab');
  const experiment = join(session.farm.folder, 'experiment.json');
  const scene = join(kSource, 'scenes/cornell-bench-blocks.json');
  const plan = {scenes: [scene], methods: ['path', 'vcm'], seeds: 1, width: 32, height: 32, samples: [4, 16], reference: {method: 'path', samples: 64, seed: 9}};
  writeFileSync(experiment, JSON.stringify(plan));
  session.farm.lightmill('lab', experiment, '-o', folder);
  const results = JSON.parse(readFileSync(join(folder, 'results.json'), 'utf8'));
  await page.goto(`${session.farm.page}#/lab`);
  await page.getByText('lightmill lab EXPERIMENT').waitFor();
  await page.getByLabel('The results.json of a lab').setInputFiles(experiment);
  await page.getByRole('alert').getByText('experiment.json: a scene is not an object').waitFor();
  const dropped = await page.evaluateHandle((text) => {
    const transfer = new DataTransfer();
    transfer.items.add(new File([text], 'results.json'));
    return transfer;
  }, JSON.stringify(results));
  await page.locator('.lab').dispatchEvent('drop', {dataTransfer: dropped});
  const lines = page.locator('.chart-lines li');
  await eventually('both methods are there', async () => (await lines.count()) === 2);
  assert.equal(await page.getByRole('alert').count(), 0);
  await page.locator('.uplot').first().waitFor();
  await page.getByRole('img', {name: /^Error against time/}).focus();
  await page.keyboard.press('ArrowRight');
  const [curve] = results.scenes[0].methods.map((each) => each.curve);
  await eventually('values are shown', async () => (await lines.first().locator('.chart-value').textContent()) !== '');
  const shown = Number.parseFloat(await lines.first().locator('.chart-value').textContent());
  assert.ok(curve.some((point) => Math.abs(shown / point.rel_mse - 1) < 1e-3), `${shown}`);
  if (pictures) {
    await page.screenshot({path: join(pictures, 'lab.png')});
  }
});

test('the page contacts only the coordinator and logs no error', () => session.assertQuiet());
