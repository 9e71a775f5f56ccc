// Starts a farm with the arguments of the manifests, and with the certificates and tokens of the pages in docs/operate. Only
// paths and ports differ.
'use strict';
const assert = require('node:assert');
const childProcess = require('node:child_process');
const fs = require('node:fs');
const os = require('node:os');
const path = require('node:path');

/** The commands `lightmill certs …` and `lightmill tokens …` below a heading of the page. */
function accessCommands(docs, heading) {
  const section = docs.split(/^## /m).find((text) => text.startsWith(heading));
  return [...section.matchAll(/^lightmill ((?:certs|tokens) [^#\n]*)/gm)].map((match) => match[1].trim().split(/\s+/));
}

/** Runs both programs until the coordinator knows the worker. ada and the other askers query it. Then stops them. */
async function startFarm({bin, commands, serverArgs, workerArgs, askers}) {
  const {BackgroundProgram, endAll, eventually} = await import('../../e2e/farm.mjs');
  const folder = fs.mkdtempSync(path.join(os.tmpdir(), 'lightmill-manifests-'));
  const file = (name) => path.join(folder, name);
  const run = (program, args) => childProcess.spawnSync(path.join(bin, program), args, {cwd: folder, encoding: 'utf8'});
  const running = [];
  const start = (program, args) => running.push(new BackgroundProgram(path.join(bin, program), args, file(`${program}.log`)));
  const own = (args) =>
    args.map((arg) =>
      arg
        .replace('/etc/lightmill/certs', file('certs'))
        .replace('/var/lib/lightmill', file('data'))
        .replace(/0\.0\.0\.0:\d+/, '127.0.0.1:0'),
    );
  const make = (kind, ...more) => {
    for (const command of commands.filter((each) => each[0] === kind)) {
      const made = run('lightmill', [...command, ...more]);
      assert.strictEqual(made.status, 0, `lightmill ${command.join(' ')}: ${made.stderr}`);
    }
  };
  const as = (who, port) => ['--server', `localhost:${port}`, '--tls-ca', 'certs/ca.pem', '--tls-cert', `certs/${who}.pem`];
  try {
    make('certs');
    start('lightmill-server', [...own(serverArgs), `--port-file=${file('port')}`]);
    const port = (
      await eventually('the coordinator starts', () => fs.existsSync(file('port')) && fs.readFileSync(file('port'), 'utf8'))
    ).trim();
    make('tokens', ...as('ada', port));
    start(
      'lightmill-worker',
      own(workerArgs).map((arg) =>
        arg.replace(/^--server=.*/, `--server=localhost:${port}`).replace(/^--threads=.*/, '--threads=1'),
      ),
    );
    for (const asker of ['ada', ...askers]) {
      const ask = () => run('lightmill', ['workers', '--json', ...as(asker, port)]);
      await eventually(`${asker} sees the worker`, () => {
        const answer = ask();
        return answer.status === 0 && JSON.parse(answer.stdout).workers.length === 1;
      });
    }
  } catch (error) {
    throw new Error(`${error.message}\n${running.map((program) => fs.readFileSync(program.log, 'utf8')).join('\n')}`);
  } finally {
    try {
      await endAll(running, 'SIGTERM');
    } finally {
      fs.rmSync(folder, {recursive: true});
    }
  }
}

module.exports = {accessCommands, startFarm};
