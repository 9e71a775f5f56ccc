/**
 * A reader of colours in EXR files of Lightmill, and most others: scan lines, uncompressed or with RLE, ZIPS or ZIP. The layout is that of
 * "OpenEXR File Layout" (openexr.com).
 */
import type {Rect} from './film';
import {kHalfValues} from './half';

export interface ExrPicture {
  /** The pixels' place in the frame. */
  window: Rect;
  /** Linear R, G and B as planes, rows from the top. */
  rgb: Float32Array;
}

/** The reason why a file cannot be read, and the remedy. */
export class ExrError extends Error {}

const kMaxPixels = 134_217_728;
const kCompressions = ['none', 'RLE', 'ZIPS', 'ZIP', 'PIZ', 'PXR24', 'B44', 'B44A', 'DWAA', 'DWAB'];
const kLinesOfBlock = [1, 1, 1, 16];
const kPixelTypes = ['uint', 'half', 'float'] as const;
const kBytesOfType = {uint: 4, half: 2, float: 4};

interface Channel {
  name: string;
  type: (typeof kPixelTypes)[number];
}

interface Header {
  channels: Channel[];
  compression: number;
  window: Rect;
  /** The start of the table of block offsets. */
  end: number;
}

class Reader {
  at = 0;
  private readonly view: DataView;
  constructor(readonly bytes: Uint8Array) {
    this.view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  }
  skip(count: number): number {
    const from = this.at;
    if (!(count >= 0 && from + count <= this.bytes.length)) {
      throw new ExrError('the file is truncated');
    }
    this.at += count;
    return from;
  }
  byte = () => this.bytes[this.skip(1)]!;
  int = () => this.view.getInt32(this.skip(4), true);
  long = () => Number(this.view.getBigUint64(this.skip(8), true));
  text(): string {
    const end = this.bytes.indexOf(0, this.at);
    const from = this.skip(Math.max(end - this.at, 0) + 1);
    return new TextDecoder().decode(this.bytes.subarray(from, this.at - 1));
  }
}

function readChannels(reader: Reader, end: number): Channel[] {
  const channels: Channel[] = [];
  while (reader.at < end - 1) {
    const name = reader.text();
    const type = kPixelTypes[reader.int()];
    reader.skip(4);
    const [across, down] = [reader.int(), reader.int()];
    if (!type || across !== 1 || down !== 1) {
      throw new ExrError(`channel ${name} is subsampled, which is not supported`);
    }
    channels.push({name, type});
  }
  return channels;
}

function readWindow(reader: Reader): Rect {
  const [x, y, right, bottom] = [reader.int(), reader.int(), reader.int(), reader.int()];
  const [width, height] = [right - x + 1, bottom - y + 1];
  if (width < 1 || height < 1 || width * height > kMaxPixels) {
    throw new ExrError(`a picture of ${width}×${height} pixels cannot be read: it must have 1 to ${kMaxPixels} pixels`);
  }
  return {x, y, width, height};
}

function readHeader(reader: Reader): Header {
  if (reader.bytes.length < 8 || reader.int() !== 20000630) {
    throw new ExrError('this is not an EXR file');
  }
  if (reader.int() & 0x1a00) {
    throw new ExrError('tiled, multi-part and deep files are not supported: save it as one part of scan lines');
  }
  let [channels, window]: [Channel[], Rect | undefined] = [[], undefined];
  let compression = -1;
  for (let name = reader.text(); name !== ''; name = reader.text()) {
    reader.text();
    const size = reader.int();
    const from = reader.skip(size);
    const value = new Reader(reader.bytes.subarray(from, from + size));
    if (name === 'channels') {
      channels = readChannels(value, size);
    } else if (name === 'compression') {
      compression = value.byte();
    } else if (name === 'dataWindow') {
      window = readWindow(value);
    }
  }
  if (!(compression in kLinesOfBlock)) {
    throw new ExrError(`compression ${kCompressions[compression] ?? compression} is not supported: save it with ZIP`);
  }
  if (!window) {
    throw new ExrError('the file does not say how large its picture is');
  }
  return {channels, compression, window, end: reader.at};
}

async function inflated(bytes: Uint8Array<ArrayBuffer>, size: number): Promise<Uint8Array> {
  const out = new Uint8Array(size);
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream('deflate')).getReader();
  let filled = 0;
  for (let part = await stream.read(); !part.done; part = await stream.read()) {
    if (filled + part.value.length > size) {
      await stream.cancel();
      throw new ExrError('a block is longer than its lines');
    }
    out.set(part.value, filled);
    filled += part.value.length;
  }
  return out.subarray(0, filled);
}

/** Decodes RLE. A count of 0 to 127 repeats the next byte once more often. A negative count -n copies n bytes. */
function unpackedRuns(bytes: Uint8Array, size: number): Uint8Array {
  const out = new Uint8Array(size);
  let filled = 0;
  for (let i = 0; i < bytes.length; ) {
    const count = (bytes[i++]! << 24) >> 24;
    const length = count < 0 ? -count : count + 1;
    if (filled + length > size) {
      throw new ExrError('a block is longer than its lines');
    }
    if (count < 0) {
      out.set(bytes.subarray(i, i + length), filled);
      i += length;
    } else {
      out.fill(bytes[i++]!, filled, filled + length);
    }
    filled += length;
  }
  return out.subarray(0, filled);
}

/** Undoes the step before compression: differences of bytes, with even bytes before odd ones. */
function restored(bytes: Uint8Array): Uint8Array {
  for (let i = 1; i < bytes.length; ++i) {
    bytes[i] = bytes[i - 1]! + bytes[i]! - 128;
  }
  const out = new Uint8Array(bytes.length);
  const half = (bytes.length + 1) >> 1;
  for (let i = 0; i < bytes.length; ++i) {
    out[i] = bytes[i & 1 ? half + (i >> 1) : i >> 1]!;
  }
  return out;
}

async function unpacked(bytes: Uint8Array<ArrayBuffer>, size: number, compression: number): Promise<Uint8Array> {
  // A block that would not become smaller is stored uncompressed.
  if (compression === 0 || bytes.length === size) {
    return bytes;
  }
  return restored(compression === 1 ? unpackedRuns(bytes, size) : await inflated(bytes, size));
}

function valueReader(type: Channel['type'], view: DataView): (at: number) => number {
  switch (type) {
    case 'half':
      return (at) => kHalfValues[view.getUint16(at, true)]!;
    case 'float':
      return (at) => view.getFloat32(at, true);
    case 'uint':
      return (at) => view.getUint32(at, true);
  }
}

/** The planes of the result that each channel fills. Luminance alone gives a grey picture. */
function planesOf(channels: Channel[]): number[][] {
  const has = (name: string) => channels.some((channel) => channel.name === name);
  const colored = ['R', 'G', 'B'].every(has);
  if (!colored && !has('Y')) {
    const names = channels.slice(0, 8).map((channel) => channel.name);
    throw new ExrError(`the file has neither R, G and B nor Y. Its channels: ${names.join(', ') || 'none'}`);
  }
  return channels.map(({name}) => (colored ? ['R', 'G', 'B'].flatMap((each, plane) => (each === name ? [plane] : [])) : name === 'Y' ? [0, 1, 2] : []));
}

/** Rejects other files with an ExrError. */
export async function readExr(bytes: Uint8Array<ArrayBuffer>): Promise<ExrPicture> {
  const reader = new Reader(bytes);
  const header = readHeader(reader);
  const {channels, window, compression} = header;
  const planes = planesOf(channels);
  const lineBytes = window.width * channels.reduce((sum, channel) => sum + kBytesOfType[channel.type], 0);
  const linesOfBlock = kLinesOfBlock[compression]!;
  const pixels = window.width * window.height;
  const blocks = Math.ceil(window.height / linesOfBlock);
  if (reader.bytes.length - header.end < 16 * blocks) {
    throw new ExrError('the file is truncated');
  }
  const rgb = new Float32Array(3 * pixels);
  for (let block = 0; block < blocks; ++block) {
    reader.at = header.end + 8 * block;
    reader.at = reader.long();
    const first = reader.int() - window.y;
    const size = reader.int();
    const from = reader.skip(size);
    const lines = Math.min(linesOfBlock, window.height - first);
    if (!(first >= 0 && lines > 0)) {
      throw new ExrError(`a block begins at line ${first + window.y}, outside the picture`);
    }
    const raw = await unpacked(bytes.subarray(from, from + size), lines * lineBytes, compression).catch((error: unknown) => {
      throw error instanceof ExrError ? error : new ExrError(`lines ${first} to ${first + lines - 1} are damaged`);
    });
    if (raw.length !== lines * lineBytes) {
      throw new ExrError(`lines ${first} to ${first + lines - 1} are damaged: ${raw.length} of ${lines * lineBytes} bytes`);
    }
    const view = new DataView(raw.buffer, raw.byteOffset, raw.byteLength);
    let at = 0;
    for (let line = first; line < first + lines; ++line) {
      channels.forEach(({type}, c) => {
        const value = valueReader(type, view);
        const step = kBytesOfType[type];
        for (const plane of planes[c]!) {
          for (let x = 0; x < window.width; ++x) {
            rgb[plane * pixels + line * window.width + x] = value(at + step * x);
          }
        }
        at += step * window.width;
      });
    }
  }
  return {window, rgb};
}
