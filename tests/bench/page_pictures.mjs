// Pictures of the page for the documents, from a farm of its own: node page_pictures.mjs FOLDER-OF-PROGRAMS FOLDER [NAME…]
// Writes FOLDER/web.png and FOLDER/web-NAME.png, or only those named. All take about five minutes on two cores.
import {cpSync, readFileSync, writeFileSync} from 'node:fs';
import {join} from 'node:path';
import {eventually, kSource} from '../e2e/farm.mjs';
import {Session} from '../e2e/session.mjs';

const [programs, folder, ...names] = process.argv.slice(2);
if (folder === undefined) {
  console.error('usage: node page_pictures.mjs FOLDER-OF-PROGRAMS FOLDER [NAME…]');
  process.exit(2);
}
const session = new Session(programs);
const kScene = join(kSource, 'scenes/cornell-bench-blocks.json');
const pause = (ms) => new Promise((resolve) => setTimeout(resolve, ms));
const open = (path) => session.open(path, {viewport: {width: 1280, height: 860}});
const submit = (scene, name, ...options) =>
  session.farm.lightmill('submit', scene, '--name', name, '--size', '512x512', ...options).trim();

/** A finished job on the page. */
async function finished(scene, name, ...options) {
  const job = submit(scene, name, ...options);
  await session.waitForState(job, 'DONE');
  const page = await open(`#/jobs/${job}`);
  await page.waitForSelector('canvas[data-drawn]');
  return page;
}

/** The box of blocks with `change` made to its scene. */
function changedBox(file, change) {
  const scene = JSON.parse(readFileSync(kScene, 'utf8'));
  change(scene);
  const path = join(session.farm.folder, file);
  writeFileSync(path, JSON.stringify(scene));
  cpSync(join(kSource, 'scenes/assets'), join(session.farm.folder, 'assets'), {recursive: true});
  return path;
}

/** Moves the mouse to a share of the picture's width and height. */
async function pointAt(page, x, y) {
  const box = await page.locator('.viewer canvas').boundingBox();
  await page.mouse.move(box.x + x * box.width, box.y + y * box.height, {steps: 3});
}

const kPictures = {
  async web() {
    const job = submit(join(kSource, 'scenes/cornell-bench-balls.json'), 'balls', '--spp', '256', '--method', 'vcm');
    const page = await open(`#/jobs/${job}`);
    await eventually('two thirds', async () => Number(/(\d+)%/.exec(await page.locator('.job-head').textContent())?.[1]) >= 66, 600_000);
    await pointAt(page, 0.55, 0.8);
    return page;
  },

  async relight() {
    const scene = changedBox('two-lights.json', (box) => {
      box.materials.find(({name}) => name === 'lamp').light_group = 'lamp';
      const spot = {position: [278, 500, 60], direction: [0, -1, 0.35], intensity: {rgb: [20000, 60000, 200000]}, cutoff_degrees: 35, blend: 0.4};
      box.lights = [{name: 'spot', group: 'blue', spot}];
    });
    const page = await finished(scene, 'two lights', '--spp', '128', '--method', 'path', '--layers', 'light:lamp,light:blue');
    await page.getByRole('region', {name: 'Light groups'}).getByLabel('Light: blue: stops').fill('2');
    // The last tile of the layers has arrived when its pixel has samples.
    await eventually('all pixels', async () => {
      await pointAt(page, 0.7, 0.97);
      await pointAt(page, 0.71, 0.97);
      return (await page.locator('.pixel dd').allTextContents())[5] === '128';
    });
    return page;
  },

  async meters() {
    const scene = changedBox('measured-box.json', (box) => {
      box.meters = [
        {name: 'below the light', irradiance: {point: [278, 540, 279.5], normal: [0, -1, 0]}},
        {name: 'back wall', irradiance: {point: [140, 400, 558], normal: [0, 0, -1]}},
        {name: 'floor', patch: {corner: [420, 1, 60], edge1: [0, 0, 110], edge2: [110, 0, 0]}},
      ];
    });
    return finished(scene, 'blocks with meters', '--spp', '128', '--method', 'path');
  },

  async photons() {
    const page = await finished(kScene, 'blocks', '--spp', '128', '--method', 'path');
    await page.getByRole('combobox', {name: 'Photon map'}).selectOption({label: '10,000'});
    await eventually('photons', async () => {
      const {jobs} = await (await fetch(`${session.farm.page}api/v1/jobs`)).json();
      return jobs.some(({name, state}) => name.endsWith('(photon map)') && state === 'JOB_STATE_DONE');
    });
    return page;
  },

  async compare() {
    const many = submit(kScene, 'many samples', '--spp', '256', '--method', 'path', '--seed', '7');
    const page = await finished(kScene, 'few samples', '--spp', '8', '--method', 'path');
    await session.waitForState(many, 'DONE');
    await page.getByRole('combobox', {name: 'Compare with'}).selectOption(many);
    await eventually('numbers', async () => /FLIP\s*0\.\d/.test(await page.locator('.side').textContent()));
    await page.locator('.viewer canvas').focus();
    await page.keyboard.press('s');
    const box = await page.locator('.viewer').boundingBox();
    const divider = await page.getByRole('separator').boundingBox();
    await page.mouse.move(divider.x + divider.width / 2, box.y + 300);
    await page.mouse.down();
    await page.mouse.move(box.x + 0.55 * box.width, box.y + 300, {steps: 4});
    await page.mouse.up();
    await page.getByRole('separator').evaluate((each) => each.blur());
    await pointAt(page, 0.4, 0.8);
    return page;
  },

  async submit() {
    const page = await open('#/jobs');
    await page.getByRole('status').getByText('live').waitFor();
    const meshes = ['CornellBox.obj', 'CornellBlocks.obj'].map((name) => join(kSource, 'scenes/assets', name));
    await page.getByLabel('Scene files').setInputFiles([kScene, ...meshes]);
    await page.getByRole('heading', {name: 'The scene'}).waitFor();
    return page;
  },

  async edit() {
    const page = await finished(kScene, 'blocks', '--spp', '128', '--method', 'path');
    await page.getByRole('button', {name: 'Edit & render again'}).click();
    await page.getByLabel('Live picture').selectOption('path');
    await pointAt(page, 0.5, 0.5);
    await page.mouse.down();
    const box = await page.locator('.viewer canvas').boundingBox();
    await page.mouse.move(box.x + 0.5 * box.width + 70, box.y + 0.5 * box.height + 30, {steps: 8});
    await page.mouse.up();
    await pause(8_000);
    return page;
  },

  async farm() {
    session.farm.startWorker('box-2');
    submit(kScene, 'blocks', '--spp', '100000', '--method', 'path');
    await pause(100_000);
    await session.farm.stop('box-2', 'SIGKILL');
    await pause(15_000);
    session.farm.startWorker('box-2');
    await pause(75_000);
    const page = await open('#/workers');
    await page.getByRole('button', {name: 'box-1'}).click();
    await page.getByRole('region', {name: 'History'}).getByRole('button', {name: '10 minutes'}).click();
    await pause(3_000);
    return page;
  },
};

for (const signal of ['SIGINT', 'SIGTERM']) {
  process.once(signal, () => void session.close().finally(() => process.exit(1)));
}
try {
  await session.start();
  for (const [name, take] of Object.entries(kPictures).filter(([each]) => names.length === 0 || names.includes(each))) {
    const page = await take();
    await pause(1_500);
    const path = join(folder, name === 'web' ? 'web.png' : `web-${name}.png`);
    await page.screenshot({path, fullPage: name === 'submit' || name === 'farm'});
    await page.close();
    console.log(path);
  }
} finally {
  await session.close();
}
