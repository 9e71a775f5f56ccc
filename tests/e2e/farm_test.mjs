// The farm's history, a worker's history and the event log in a real browser:
//   node farm_test.mjs FOLDER-OF-PROGRAMS [--pictures FOLDER]
import assert from 'node:assert/strict';
import {readFileSync} from 'node:fs';
import {join} from 'node:path';
import {after, before, test} from 'node:test';
import {eventually, kSource} from './farm.mjs';
import {assertFits, kPhone, Session} from './session.mjs';

const [programs, ...options] = process.argv.slice(2);
const pictures = options[0] === '--pictures' ? options[1] : undefined;
const session = new Session(programs);
const kScene = join(kSource, 'scenes/cornell-bench-blocks.json');
let page;
let job;

before(() => session.start());
after(() => session.close());

const section = (name) => page.getByRole('region', {name});
/** The coordinator has a worker's first minute only after a minute. For pictures, the page waits for it. */
async function giveAMinute(page) {
  const minutes = [{unix_ms: String(Date.now()), seconds: 60, results: '3', leases_lost: '2', pixel_samples: 1000}];
  if (!pictures) {
    await page.route(/workers\/box-1\/history$/, (route) => route.fulfill({json: {minutes}}));
  }
}
const eventTexts = () => page.getByRole('list', {name: 'Events, newest first'}).locator('li').allInnerTexts();

test('the charts show what the farm did', async () => {
  page = await session.open('#/workers');
  await section('History').getByText('No history yet. The coordinator records it from its start').waitFor();
  job = session.farm.lightmill('submit', kScene, '--size', '128x128', '--spp', '1000000').trim();
  const throughput = page.getByRole('img', {name: /^Throughput/});
  await throughput.waitFor();
  await eventually('a speed', async () => /merged (?!–|0 )/.test(await throughput.getAttribute('aria-label')));
  assert.match(await page.getByRole('img', {name: /^Threads/}).getAttribute('aria-label'), /all 1, busy [01]\b/);
  // The canvas is drawn if some of its pixels have colour.
  const drawn = () =>
    throughput.locator('canvas').evaluate((canvas) => {
      const {data} = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
      return data.some((value, i) => i % 4 === 3 && value > 200);
    });
  await eventually('lines', drawn);
  for (const span of ['10 minutes', 'day', 'hour']) {
    const button = section('History').getByRole('button', {name: span});
    await button.click();
    assert.equal(await button.getAttribute('aria-pressed'), 'true');
  }
});

test('the arrow keys move through the times of all charts at once', async () => {
  const charts = ['Throughput', 'Threads', 'Jobs'].map((name) => page.getByRole('img', {name: new RegExp(`^${name}`)}));
  const moments = () => Promise.all(charts.map(async (chart) => /, (\d\d:\d\d:\d\d):/.exec(await chart.getAttribute('aria-label'))?.[1]));
  assert.deepEqual(await moments(), [undefined, undefined, undefined]);
  await charts[1].focus();
  await page.keyboard.press('ArrowLeft');
  await eventually('a moment', async () => (await moments()).every((each) => each !== undefined));
  assert.equal(new Set(await moments()).size, 1);
  await charts[1].evaluate((chart) => chart.blur());
  await eventually('the last moment again', async () => (await moments()).every((each) => each === undefined));
});

test('the history is saved as CSV', async () => {
  const [download] = await Promise.all([page.waitForEvent('download'), section('History').getByRole('button', {name: 'CSV'}).click()]);
  const lines = readFileSync(await download.path(), 'utf8').trim().split('\n');
  assert.match(lines[0], /^until,seconds,pixel_samples,/);
  assert.ok(lines.length > 1);
});

test('events show what happened, by kind, with a link to the job', async () => {
  await eventually('the start of the job', async () => (await eventTexts()).some((text) => text.includes(`job ${job} starts on worker box-1`)));
  const kinds = page.getByRole('group', {name: 'Kind of events'});
  await kinds.getByRole('button', {name: 'workers'}).click();
  assert.ok((await eventTexts()).every((text) => text.includes('box-1')));
  await session.farm.stop('box-1', 'SIGKILL');
  await eventually('its end', async () => (await eventTexts()).some((text) => /worker box-1 disconnected with \d leases?/.test(text)));
  await kinds.getByRole('button', {name: 'warnings'}).click();
  await eventually('what it had', async () => (await eventTexts()).some((text) => text.includes('worker box-1 lost lease')));
  session.farm.startWorker('box-1');
  await kinds.getByRole('button', {name: 'all'}).click();
  await page.getByRole('link', {name: `job ${job}`, exact: true}).first().click();
  await page.waitForURL(new RegExp(`#/jobs/${job}`));
  await page.goBack();
  session.farm.lightmill('cancel', job);
});

test("a worker's name opens its last hour", async () => {
  const opener = page.getByRole('button', {name: 'box-1'});
  await giveAMinute(page);
  await opener.focus();
  await page.keyboard.press('Enter');
  assert.equal(await opener.getAttribute('aria-expanded'), 'true');
  await page.getByRole('list', {name: 'Events of box-1'}).locator('li').first().waitFor();
  await eventually('a minute', async () => (await page.getByText(/Last hour: \d+ results?, [1-9]\d* leases? lost/).count()) === 1);
  if (pictures) {
    await page.screenshot({path: join(pictures, 'farm.png'), fullPage: true});
  }
  await page.keyboard.press('Enter');
  assert.equal(await page.getByRole('list', {name: 'Events of box-1'}).count(), 0);
});

test('a worker is put into quarantine by hand, and released', async () => {
  const row = page.getByRole('row', {name: /box-1/});
  const act = async (name) => {
    page.once('dialog', (dialog) => dialog.accept());
    await row.getByRole('button', {name}).click();
  };
  const quarantine = async () => {
    const {workers} = await (await fetch(`${session.farm.page}api/v1/workers`)).json();
    return workers.find(({name}) => name === 'box-1').quarantine ?? '';
  };
  await act('Quarantine');
  await row.getByText('put there by hand').waitFor();
  assert.match(await quarantine(), /put there by hand/);
  await act('Release');
  await row.getByRole('button', {name: 'Quarantine'}).waitFor();
  assert.equal(await quarantine(), '');
});

test('the history and the events fit a phone and pass axe', async () => {
  for (const colorScheme of ['light', 'dark']) {
    const small = await session.open('#/workers', {viewport: kPhone, colorScheme, bypassCSP: true});
    await small.getByRole('img', {name: /^Throughput/}).waitFor();
    await giveAMinute(small);
    await small.getByRole('button', {name: 'box-1'}).click();
    await small.getByText(/Last hour: /).waitFor();
    if (pictures) {
      await small.screenshot({path: join(pictures, `farm-phone-${colorScheme}.png`), fullPage: true});
    }
    await assertFits(small);
    await small.context().close();
  }
});

test('the page contacts only the coordinator and logs no error', () => session.assertQuiet());
