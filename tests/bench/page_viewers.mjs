// Cost of open pages to the coordinator:
//   node page_viewers.mjs FOLDER-OF-PROGRAMS [VIEWERS [SECONDS]]
// Viewers read everything at once. It prints the coordinator's processor time with and without them, and the bytes they received.
import {readFileSync} from 'node:fs';
import {connect} from 'node:net';
import {eventually, Farm} from '../e2e/farm.mjs';
import {helpOf} from './usage.mjs';

helpOf(`usage: node tests/bench/page_viewers.mjs FOLDER-OF-PROGRAMS [VIEWERS [SECONDS]]

Prints the share of a core that the coordinator uses without and with VIEWERS (100) of one job, each over SECONDS (20).
FOLDER-OF-PROGRAMS: build/release/bin.`);

const [programs, viewerCount = '100', seconds = '20'] = process.argv.slice(2);

/** A ViewRequest for a job, in one masked WebSocket frame. Numbers are below 2^28. */
function requestFrame(job, seen) {
  const varint = (value) => {
    const bytes = [];
    for (; value > 127; value >>= 7) {
      bytes.push((value & 127) | 128);
    }
    return [...bytes, value];
  };
  const payload = [0x20, ...varint(job), 0x28, ...varint(seen)];
  return Buffer.from([0x82, 0x80 | payload.length, 0, 0, 0, 0, ...payload]);
}

class Viewer {
  constructor(farm, job) {
    this.messages = this.bytes = 0;
    let [buffer, upgraded] = [Buffer.alloc(0), false];
    this.socket = connect(farm.httpPort, '127.0.0.1', () =>
      this.socket.write(
        `GET /api/v1/live HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n` +
          `Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n`,
      ),
    );
    this.socket.on('data', (chunk) => {
      buffer = buffer.length > 0 ? Buffer.concat([buffer, chunk]) : chunk;
      if (!upgraded) {
        const end = buffer.indexOf('\r\n\r\n');
        if (end < 0) {
          return;
        }
        upgraded = true;
        buffer = buffer.subarray(end + 4);
        this.socket.write(requestFrame(job, 0));
      }
      for (;;) {
        const frame = frameAt(buffer);
        if (!frame) {
          return;
        }
        buffer = buffer.subarray(frame.size);
        if (frame.binary) {
          this.messages += 1;
          this.bytes += frame.size;
          this.socket.write(requestFrame(job, this.messages));
        }
      }
    });
  }
}

function frameAt(buffer) {
  if (buffer.length < 2) {
    return undefined;
  }
  const short = buffer[1] & 127;
  const header = short < 126 ? 2 : short === 126 ? 4 : 10;
  if (buffer.length < header) {
    return undefined;
  }
  const length = short < 126 ? short : short === 126 ? buffer.readUInt16BE(2) : Number(buffer.readBigUInt64BE(2));
  return buffer.length < header + length ? undefined : {size: header + length, binary: (buffer[0] & 15) === 2};
}

/** Processor seconds of a process. */
function processorSeconds(pid) {
  const fields = readFileSync(`/proc/${pid}/stat`, 'utf8').split(') ')[1].split(' ');
  return (Number(fields[11]) + Number(fields[12])) / 100;
}

const farm = new Farm(programs);
try {
  await farm.startServer();
  farm.startWorker('w');
  const job = Number(farm.submit('cornell-bench-blocks', '--spp', '1000000', '--size', '256x256', '--method', 'path'));
  await eventually('the first round is over', async () => {
    const state = await (await fetch(`${farm.page}api/v1/jobs/${job}`)).json();
    return Number(state.min_tile_samples) > 2;
  });
  const {pid} = farm.running.get('server').child;
  const wait = () => new Promise((resolve) => setTimeout(resolve, 1000 * Number(seconds)));
  const measure = async (viewers) => {
    const [before, began] = [processorSeconds(pid), Date.now()];
    const [messages, bytes] = [viewers.reduce((sum, each) => sum + each.messages, 0), viewers.reduce((sum, each) => sum + each.bytes, 0)];
    await wait();
    const elapsed = (Date.now() - began) / 1000;
    return {
      core: (processorSeconds(pid) - before) / elapsed,
      updates: (viewers.reduce((sum, each) => sum + each.messages, 0) - messages) / elapsed / Math.max(viewers.length, 1),
      megabytes: (viewers.reduce((sum, each) => sum + each.bytes, 0) - bytes) / elapsed / 1e6,
    };
  };
  const alone = await measure([]);
  const viewers = Array.from({length: Number(viewerCount)}, () => new Viewer(farm, job));
  await eventually('every viewer has seen the job', () => viewers.every((viewer) => viewer.messages > 0));
  const watched = await measure(viewers);
  console.log(`without viewers: ${alone.core.toFixed(3)} core`);
  console.log(
    `${viewers.length} viewers: ${watched.core.toFixed(3)} core; each got ${watched.updates.toFixed(1)} updates/s, all together ${watched.megabytes.toFixed(1)} MB/s`,
  );
  viewers.forEach((viewer) => viewer.socket.destroy());
} finally {
  await farm.close();
}
