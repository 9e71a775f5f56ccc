// Crashes of a farm's programs fail the test of the page: node crashes_test.mjs FOLDER-OF-PROGRAMS
import assert from 'node:assert/strict';
import {test} from 'node:test';
import {eventually, Farm} from './farm.mjs';

const [programs] = process.argv.slice(2);

/** A farm whose worker is connected. */
async function start() {
  const farm = new Farm(programs);
  await farm.startServer();
  farm.startWorker('box-1');
  await eventually('the worker is connected', () => JSON.parse(farm.lightmill('workers', '--json')).workers.length === 1);
  return farm;
}

test('a worker that the test did not end fails it', async () => {
  const farm = await start();
  process.kill(farm.running.get('box-1').child.pid, 'SIGSEGV');
  await eventually('the farm has noticed', () => JSON.parse(farm.lightmill('workers', '--json')).workers.length === 0);
  await assert.rejects(farm.close(), /lightmill-worker ended with SIGSEGV/);
});

test('ends that the test causes are no crashes', async () => {
  const farm = await start();
  await farm.stop('box-1');
  farm.startWorker('box-2');
  await farm.stop('box-2', 'SIGKILL');
  await farm.close();
});
