// The web page's lists, actions and connection in a real browser with a real farm:
//   node page_test.mjs FOLDER-OF-PROGRAMS
import assert from 'node:assert/strict';
import {readdirSync, readFileSync, statSync} from 'node:fs';
import {join} from 'node:path';
import {after, before, test} from 'node:test';
import {eventually} from './farm.mjs';
import {assertFits, kDesktop, kPhone, Session} from './session.mjs';

const programs = process.argv[2];
const session = new Session(programs);
let page;
let job;

before(() => session.start());
after(() => session.close());

test('the page loads less than 300 KB of compressed script', () => {
  const assets = join(programs, 'lightmill-web/assets');
  const scripts = readdirSync(assets).filter((name) => name.endsWith('.js.gz'));
  assert.ok(scripts.length > 0);
  const bytes = scripts.reduce((sum, name) => sum + statSync(join(assets, name)).size, 0);
  assert.ok(bytes < 300_000, `${bytes} bytes`);
});

test('an empty farm says how to submit', async () => {
  page = await session.open('#/jobs');
  await page.getByText('lightmill submit').waitFor();
  await page.getByRole('status').getByText('live').waitFor();
});

test('a submitted job appears and opens', async () => {
  job = session.farm.submit('cornell-bench-blocks', '--spp', '32', '--size', '192x160', '--name', 'blocks in a box');
  await page.getByRole('link', {name: 'blocks in a box'}).click();
  await page.waitForSelector('canvas[data-drawn]');
  await session.waitForState(job, 'DONE');
  await page.locator('.job-head .badge', {hasText: 'done'}).waitFor();
});

test('the EXR from the page is the file of the command line', async () => {
  const [download] = await Promise.all([page.waitForEvent('download'), page.getByRole('link', {name: 'EXR'}).click()]);
  assert.equal(download.suggestedFilename(), `job-${job}.exr`);
  const file = join(session.farm.folder, 'box.exr');
  session.farm.lightmill('fetch', job, '-o', file);
  assert.ok(readFileSync(await download.path()).equals(readFileSync(file)));
});

test('a job is paused, resumed, extended and cancelled from the page', async () => {
  const other = session.farm.submit('cornell-bench-balls', '--spp', '100000', '--size', '256x256', '--method', 'path', '--name', 'balls');
  await page.goto(`${session.farm.page}#/jobs/${other}`);
  await page.getByRole('button', {name: 'Pause'}).click();
  await session.waitForState(other, 'PAUSED');
  await page.getByRole('button', {name: 'Resume'}).click();
  await session.waitForState(other, 'RUNNING');
  await page.getByLabel('New total of samples').fill('10');
  await page.getByRole('button', {name: 'Extend'}).click();
  await page.getByRole('alert').getByText('samples').waitFor();
  await page.getByLabel('New total of samples').fill('200000');
  await page.getByRole('button', {name: 'Extend'}).click();
  await page.getByText('200000 samples').waitFor();
  page.once('dialog', (dialog) => dialog.accept());
  await page.getByRole('button', {name: 'Cancel'}).click();
  await session.waitForState(other, 'CANCELLED');
  await page.locator('.job-head .badge', {hasText: 'cancelled'}).waitFor();
});

test('jobs are found, filtered and opened by keys alone', async () => {
  await page.goto(`${session.farm.page}#/jobs`);
  await page.getByRole('row').nth(2).waitFor();
  await page.waitForFunction(() => [...document.querySelectorAll('.thumbnail img')].every((image) => image.naturalWidth > 0));
  await page.keyboard.press('/');
  await page.keyboard.type('blocks');
  await eventually('one job is left', async () => (await page.locator('tbody tr').count()) === 1);
  await page.keyboard.press('ArrowDown');
  await page.keyboard.press('Enter');
  await eventually('the job opens', () => page.url().endsWith(`#/jobs/${job}`));
  await page.locator('.job-head').waitFor();  // otherwise the page is still on the list, with the typed text
  await page.goBack();
  await page.getByRole('button', {name: /^Failed/}).click();
  await page.getByRole('link', {name: 'balls'}).waitFor();
});

test('a lost connection is shown, reconnects by itself and catches up', async () => {
  await page.goto(`${session.farm.page}#/jobs`);
  await page.getByRole('button', {name: /^All/}).click();
  await session.farm.stop('server');
  await page.getByRole('alert').getByText('is lost').waitFor();
  await session.farm.startServer();
  const third = session.farm.submit('cornell-bench-blocks', '--spp', '4', '--size', '64x64', '--name', 'after the break');
  await page.getByRole('link', {name: 'after the break'}).waitFor();
  await page.getByRole('status').getByText('live').waitFor();
  assert.equal(await page.getByRole('alert').count(), 0);
  await session.waitForState(third, 'DONE');
});

test('axe finds no serious fault in light and dark, on a desktop and a phone', async () => {
  for (const [viewport, colorScheme] of [[kDesktop, 'light'], [kDesktop, 'dark'], [kPhone, 'light'], [kPhone, 'dark']]) {
    const opened = await session.open('#/jobs', {viewport, colorScheme, bypassCSP: true});
    for (const [hash, ready] of [['#/jobs', '.row-link'], [`#/jobs/${job}`, 'canvas[data-drawn]'], ['#/workers', 'tbody tr'], ['#/lab', '.empty']]) {
      await opened.goto(session.farm.page + hash);
      await opened.waitForSelector(ready);
      await assertFits(opened, `${hash} ${colorScheme}`);
    }
    await opened.context().close();
  }
});

test('a worker is drained from the page', async () => {
  await page.goto(`${session.farm.page}#/workers`);
  page.once('dialog', (dialog) => dialog.accept());
  await page.getByRole('button', {name: 'Drain'}).click();
  await page.getByText('No workers').waitFor();
});

test('the page contacts only the coordinator and logs no error', () => session.assertQuiet());
