// Crashes of a farm's programs fail the test of the page: node crashes_test.mjs FOLDER-OF-PROGRAMS
import assert from 'node:assert/strict';
import {existsSync, mkdtempSync, readFileSync, rmSync} from 'node:fs';
import {tmpdir} from 'node:os';
import {join} from 'node:path';
import {test} from 'node:test';
import {BackgroundProgram, eventually, Farm} from './farm.mjs';

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

test('in the coverage build a program writes its counts before it is killed', async (context) => {
  const folder = mkdtempSync(join(tmpdir(), 'lightmill-counts-'));
  const before = process.env.LIGHTMILL_LEAVE_MS;
  context.after(() => {
    rmSync(folder, {recursive: true, force: true});
    delete process.env.LIGHTMILL_LEAVE_MS;
    if (before !== undefined) {
      process.env.LIGHTMILL_LEAVE_MS = before;
    }
  });
  const end = async (commands, leaveMs) => {
    const [log, ready] = [join(folder, 'log'), join(folder, 'ready')];
    rmSync(log, {force: true});
    rmSync(ready, {force: true});
    const farm = new Farm(programs);
    await farm.ports.numbers;
    farm.running.set('shell', new BackgroundProgram('sh', ['-c', `${commands}; touch ${ready}; while :; do sleep 0.01; done`], log));
    await eventually('it starts', () => existsSync(ready));
    process.env.LIGHTMILL_LEAVE_MS = leaveMs;
    await farm.close();
    return readFileSync(log, 'utf8');
  };
  assert.equal(await end("trap 'echo counts; exit 0' TERM", '100000'), 'counts\n');
  assert.equal(await end("trap '' TERM", '1'), '');
  assert.equal(await end("trap 'echo counts; exit 0' TERM", '0'), '');
});
