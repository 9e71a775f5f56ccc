// A farm of real processes for browser tests: a coordinator with its page, a worker, and the command line.
import {execFileSync, spawn} from 'node:child_process';
import {closeSync, existsSync, mkdtempSync, openSync, readFileSync, rmSync} from 'node:fs';
import {tmpdir} from 'node:os';
import {join} from 'node:path';
import {fileURLToPath} from 'node:url';

export const kSource = fileURLToPath(new URL('../..', import.meta.url));

/** Limit that keeps a test from hanging. It is no expectation, because the machine can be busy. */
export const kTimeoutMs = 120_000;

/** Checks `condition` until it holds. Throws `what` after `limitMs`. */
export async function eventually(what, condition, limitMs = kTimeoutMs) {
  const until = Date.now() + limitMs;
  for (let pauseMs = 20; ; pauseMs = Math.min(1.5 * pauseMs, 200)) {
    const value = await condition();
    if (value) {
      return value;
    }
    if (Date.now() > until) {
      throw new Error(`does not happen: ${what}`);
    }
    await new Promise((resolve) => setTimeout(resolve, pauseMs));
  }
}

const kFaults = [
  ...['WARNING: ThreadSanitizer', 'ERROR: AddressSanitizer', 'ERROR: LeakSanitizer'],
  ...[': runtime error: ', ': check failed: ', 'terminate called'],
];

/** A program in the background. Its output goes to the file `log`. */
export class BackgroundProgram {
  constructor(program, options, log) {
    this.program = program;
    this.log = log;
    const file = openSync(log, 'a');
    const child = spawn(program, options, {stdio: ['ignore', file, file]});
    closeSync(file);
    this.child = child;
    this.sent = new Set();
    this.ended = new Promise((resolve) => child.on('exit', (code, signal) => resolve({code, signal})));
  }

  send(signal) {
    this.sent.add(signal);
    this.child.kill(signal);
  }

  /** Asks it to end, and waits for that, but not for more than `limitMs`. */
  async leave(limitMs) {
    this.send('SIGTERM');
    this.child.kill('SIGCONT');
    await Promise.race([this.ended, new Promise((resolve) => setTimeout(resolve, limitMs).unref())]);
  }

  /** Throws if it has crashed: another signal ended it, its exit code is not 0, or its log reports a fault. */
  async end(signal) {
    this.send(signal);
    const last = await this.ended;
    const said = readFileSync(this.log, 'utf8');
    const fault = kFaults.find((each) => said.includes(each));
    if (fault !== undefined) {
      throw new Error(`${this.program} reports a fault: ${said.slice(said.indexOf(fault)).slice(0, 4000)}`);
    }
    if (last.signal === null ? last.code !== 0 : !this.sent.has(last.signal)) {
      throw new Error(`${this.program} ended with ${last.signal ?? last.code}:\n${said.slice(-4000)}`);
    }
  }
}

/** Ends all programs, the last first. Throws if one has crashed. */
export async function endAll(programs, signal) {
  const crashes = [];
  for (const program of [...programs].reverse()) {
    await program.end(signal).catch((crash) => crashes.push(crash.message));
  }
  if (crashes.length > 0) {
    throw new Error(crashes.join('\n'));
  }
}

/** Two reserved ports. Programs can listen on them one after the other, and the kernel gives them to no other process. */
class ReservedPorts {
  static kProgram = `
import socket, sys
held = [socket.socket() for _ in range(2)]
for each in held:
    each.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    each.bind(("127.0.0.1", 0))
print(*(each.getsockname()[1] for each in held), flush=True)
sys.stdin.read()`;

  child = spawn('python3', ['-IS', '-c', ReservedPorts.kProgram], {stdio: ['pipe', 'pipe', 'inherit']});
  numbers = new Promise((resolve) => this.child.stdout.once('data', (line) => resolve(String(line).trim().split(' ').map(Number))));

  release() {
    this.child.stdin.end();
  }
}

export class Farm {
  constructor(programs) {
    this.programs = programs;
    /** More options of the coordinator, from its next start. */
    this.serverOptions = [];
    /** The command line's token; empty: none. */
    this.token = '';
    this.folder = mkdtempSync(join(tmpdir(), 'lightmill-page-'));
    this.running = new Map();
    this.ports = new ReservedPorts();
  }

  async startServer() {
    const [portFile, httpFile] = [join(this.folder, 'port'), join(this.folder, 'http')];
    rmSync(portFile, {force: true});
    rmSync(httpFile, {force: true});
    [this.port, this.httpPort] = await this.ports.numbers;
    this.start('server', [
      ...['--data', join(this.folder, 'data'), '--listen', `127.0.0.1:${this.port}`, '--port-file', portFile],
      ...['--http', `127.0.0.1:${this.httpPort}`, '--http-port-file', httpFile],
      ...this.serverOptions,
    ]);
    await eventually('the coordinator starts', () => existsSync(httpFile) && existsSync(portFile));
  }

  startWorker(name) {
    this.start('worker', ['--server', this.address, '--threads', '1', '--name', name], name);
  }

  start(program, options, name = program) {
    const log = join(this.folder, `${name}.log`);
    this.running.set(name, new BackgroundProgram(join(this.programs, `lightmill-${program}`), options, log));
  }

  async stop(name, signal = 'SIGTERM') {
    const program = this.running.get(name);
    this.running.delete(name);
    await program.end(signal);
  }

  get address() {
    return `127.0.0.1:${this.port}`;
  }
  get page() {
    return `http://127.0.0.1:${this.httpPort}/`;
  }

  /** Runs the command line to its end, and returns its output. */
  lightmill(...options) {
    const environment = {...process.env, LIGHTMILL_SERVER: this.address, LIGHTMILL_TOKEN: this.token};
    return execFileSync(join(this.programs, 'lightmill'), options, {encoding: 'utf8', env: environment, stdio: ['ignore', 'pipe', 'ignore']});
  }

  /** Submits a shipped scene, and returns the job's number. */
  submit(scene, ...options) {
    return this.lightmill('submit', join(kSource, 'scenes', `${scene}.json`), ...options).trim();
  }

  /**
   * Throws if one of its programs has crashed. With LIGHTMILL_LEAVE_MS they get SIGTERM before SIGKILL, because a killed program
   * loses its counts of lines in the coverage build.
   */
  async close() {
    try {
      const limitMs = Number(process.env.LIGHTMILL_LEAVE_MS ?? 0);
      for (const program of limitMs > 0 ? [...this.running.values()].reverse() : []) {
        await program.leave(limitMs);
      }
      await endAll(this.running.values(), 'SIGKILL');
    } finally {
      this.ports.release();
      rmSync(this.folder, {recursive: true, force: true});
    }
  }
}
