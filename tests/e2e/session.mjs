// A browser on a farm's page, with a record of its requests and errors.
import assert from 'node:assert/strict';
import {readFileSync} from 'node:fs';
import {createRequire} from 'node:module';
import {join} from 'node:path';
import {eventually, Farm, kTimeoutMs, kSource} from './farm.mjs';

const require = createRequire(join(kSource, 'client/web/package.json'));
const {chromium} = require('playwright-core');

export const kAxeFile = require.resolve('axe-core/axe.min.js');
/** Small, because a processor draws each pixel. Pictures for people are larger. */
export const kDesktop = process.argv.includes('--pictures') ? {width: 1280, height: 860} : {width: 960, height: 680};
export const kPhone = {width: 390, height: 844};

const axe = readFileSync(kAxeFile, 'utf8');

/** axe finds no serious fault, and nothing is beyond the right edge of the screen. */
export async function assertFits(page, what = page.url()) {
  await page.evaluate(axe);
  const {violations} = await page.evaluate(() => window.axe.run());
  const serious = violations.filter((each) => ['serious', 'critical'].includes(each.impact));
  assert.deepEqual(serious.map((each) => `${what}: ${each.id}: ${each.nodes.map((node) => node.html).join(' | ')}`), []);
  const wider = await page.evaluate(() => document.documentElement.scrollWidth - window.innerWidth);
  assert.ok(wider <= 0, `${what} is ${wider} pixels wider than the screen`);
}

export class Session {
  requests = [];
  faults = [];

  constructor(programs) {
    this.farm = new Farm(programs);
  }

  /** Starts the farm with one worker, box-1. */
  async start() {
    await this.farm.startServer();
    this.farm.startWorker('box-1');
    await this.startBrowser();
  }

  async startBrowser() {
    const args = ['--no-sandbox', '--enable-unsafe-swiftshader'];
    this.browser = await chromium.launch({executablePath: '/usr/bin/chromium-headless-shell', args});
  }

  async close() {
    await this.browser?.close();
    await this.farm.close();
  }

  /** Opens a separate page at `path`, such as "#/jobs". */
  async open(path, {viewport = kDesktop, colorScheme = 'dark', ...more} = {}) {
    const context = await this.browser.newContext({viewport, colorScheme, acceptDownloads: true, ...more});
    const opened = await context.newPage();
    opened.setDefaultTimeout(kTimeoutMs);
    opened.on('request', (request) => this.requests.push(request.url()));
    opened.on('pageerror', (error) => this.faults.push(error.message));
    opened.on('console', (message) => {
      if (message.type() === 'error' && !/WebSocket connection|Failed to load resource|ERR_CONNECTION/.test(message.text())) {
        this.faults.push(message.text());
      }
    });
    await opened.goto(this.farm.page + path);
    return opened;
  }

  /** The state of a job, from the page's API. */
  async stateOf(id) {
    return (await (await fetch(`${this.farm.page}api/v1/jobs/${id}`)).json()).state;
  }

  waitForState(id, state) {
    return eventually(`job ${id} is ${state}`, async () => (await this.stateOf(id)) === `JOB_STATE_${state}`);
  }

  /** The page contacted only the coordinator, and logged no error. */
  assertQuiet() {
    const others = this.requests.filter((url) => !url.startsWith(this.farm.page) && !url.startsWith('blob:'));
    assert.deepEqual(others, []);
    assert.deepEqual(this.faults, []);
  }
}
