/** The pixels of the watched job: linear RGB, standard error, and counts by tile. */
import type {Job, PixelRect} from '../wire/lightmill/v1/farm_pb';
import type {ViewTile} from '../wire/lightmill/v1/web_pb';
import {hexOf} from './bytes';
import {kHalfValues, toHalf} from './half';
import {luminance, type Rgb} from './tone';

export const kTileSide = 64;
/** Radius of the window over which squared standard errors are averaged, pixels: as in the EXR's StdErr channels. */
export const kSmoothing = 4;

/** −1, as a half. */
const kUnknown = 0xbc00;

/** A rectangle of pixels of the film's crop; (0,0) is its upper left. */
export interface Rect {
  x: number;
  y: number;
  width: number;
  height: number;
}

export interface Pixel {
  rgb: Rgb;
  luminance: number;
  /** Standard error of the luminance, smoothed over its neighbourhood; undefined while a half is missing. */
  standardError: number | undefined;
  samples: number;
}

/** The same across restarts of the coordinator. */
function identityOf(job: Job): string {
  return `${hexOf(job.traceId)} ${job.submittedUnixMs}`;
}

export class Film {
  /** R, G, B, E of each pixel as half floats, rows from the top. E is −1 where it is unknown. */
  readonly rgbe: Uint16Array;
  /** Samples per pixel, by tile. */
  readonly counts: Float32Array;
  readonly columns: number;
  readonly rows: number;
  private readonly firstColumn: number;
  private readonly firstRow: number;

  constructor(
    readonly job: bigint,
    readonly crop: Rect,
    /** Empty: beauty. */
    readonly layer = '',
    /** The job's identity. After a reconnection another farm may answer, with another job of this number. */
    private readonly identity = '',
  ) {
    this.rgbe = new Uint16Array(4 * crop.width * crop.height);
    this.firstColumn = Math.floor(crop.x / kTileSide);
    this.firstRow = Math.floor(crop.y / kTileSide);
    this.columns = Math.ceil((crop.x + crop.width) / kTileSide) - this.firstColumn;
    this.rows = Math.ceil((crop.y + crop.height) / kTileSide) - this.firstRow;
    this.counts = new Float32Array(this.columns * this.rows);
  }

  static of(job: Job, layer = ''): Film {
    const crop = job.crop ?? {x: 0, y: 0, width: job.width, height: job.height};
    return new Film(job.id, {x: crop.x, y: crop.y, width: crop.width, height: crop.height}, layer, identityOf(job));
  }

  /** Whether this is the job of the film, and not just one with its number. */
  isOf(job: Job): boolean {
    return job.id === this.job && identityOf(job) === this.identity;
  }

  /** A film of a still picture. Each pixel counts as one sample, and errors are unknown. `rgb` is as in ExrPicture. */
  static still(crop: Rect, rgb: Float32Array): Film {
    const film = new Film(0n, crop);
    const pixels = crop.width * crop.height;
    for (let i = 0; i < pixels; ++i) {
      film.rgbe.set([toHalf(rgb[i]!), toHalf(rgb[pixels + i]!), toHalf(rgb[2 * pixels + i]!), kUnknown], 4 * i);
    }
    film.counts.fill(1);
    return film;
  }

  /** Takes a tile. Returns its place in the crop, or undefined if it is outside. */
  put(tile: ViewTile): {rect: Rect; pixels: Uint16Array} | undefined {
    const rect = tile.rect && this.within(tile.rect);
    if (tile.job !== this.job || tile.layer !== this.layer || !rect || tile.rgbe.byteLength !== 8 * rect.width * rect.height) {
      return undefined;
    }
    // A copy, because the message's bytes may be unaligned.
    const pixels = new Uint16Array(tile.rgbe.slice().buffer);
    for (let row = 0; row < rect.height; ++row) {
      const from = 4 * row * rect.width;
      this.rgbe.set(pixels.subarray(from, from + 4 * rect.width), 4 * ((rect.y + row) * this.crop.width + rect.x));
    }
    this.counts[this.tileAt(rect.x, rect.y)] = Number(tile.samples);
    return {rect, pixels};
  }

  /** Copies the values of a rectangle of the crop, row by row. */
  valuesOf(rect: Rect): Uint16Array {
    const values = new Uint16Array(4 * rect.width * rect.height);
    for (let row = 0; row < rect.height; ++row) {
      const from = 4 * ((rect.y + row) * this.crop.width + rect.x);
      values.set(this.rgbe.subarray(from, from + 4 * rect.width), 4 * row * rect.width);
    }
    return values;
  }

  pixel(x: number, y: number): Pixel | undefined {
    if (x < 0 || y < 0 || x >= this.crop.width || y >= this.crop.height) {
      return undefined;
    }
    const rgb: Rgb = [this.value(x, y, 0), this.value(x, y, 1), this.value(x, y, 2)];
    return {
      rgb,
      luminance: luminance(rgb),
      standardError: this.standardError(x, y),
      samples: this.samplesAt(x, y),
    };
  }

  /** Linear R, G and B as planes, and which pixels have samples. */
  planes(): {rgb: Float32Array; known: Uint8Array} {
    const pixels = this.crop.width * this.crop.height;
    const rgb = new Float32Array(3 * pixels);
    const known = new Uint8Array(pixels);
    for (let y = 0, i = 0; y < this.crop.height; ++y) {
      for (let x = 0; x < this.crop.width; ++x, ++i) {
        known[i] = this.samplesAt(x, y) > 0 ? 1 : 0;
        rgb[i] = kHalfValues[this.rgbe[4 * i]!]!;
        rgb[pixels + i] = kHalfValues[this.rgbe[4 * i + 1]!]!;
        rgb[2 * pixels + i] = kHalfValues[this.rgbe[4 * i + 2]!]!;
      }
    }
    return {rgb, known};
  }

  /** Samples per pixel at a pixel of the crop. */
  samplesAt(x: number, y: number): number {
    return this.counts[this.tileAt(x, y)] ?? 0;
  }

  /** Sets the count of the whole tile. */
  setSamplesAt(x: number, y: number, samples: number): void {
    this.counts[this.tileAt(x, y)] = samples;
  }

  /** The count of the tile with most samples. */
  mostSamples(): number {
    return this.counts.reduce((most, count) => Math.max(most, count), 0);
  }

  private within(rect: PixelRect): Rect | undefined {
    const inside = {x: rect.x - this.crop.x, y: rect.y - this.crop.y, width: rect.width, height: rect.height};
    const fits =
      inside.x >= 0 &&
      inside.y >= 0 &&
      inside.x + inside.width <= this.crop.width &&
      inside.y + inside.height <= this.crop.height;
    return fits ? inside : undefined;
  }

  private tileAt(x: number, y: number): number {
    const column = Math.floor((this.crop.x + x) / kTileSide) - this.firstColumn;
    const row = Math.floor((this.crop.y + y) / kTileSide) - this.firstRow;
    return row * this.columns + column;
  }

  private value(x: number, y: number, channel: number): number {
    return kHalfValues[this.rgbe[4 * (y * this.crop.width + x) + channel]!]!;
  }

  private standardError(x: number, y: number): number | undefined {
    let sum = 0;
    let known = 0;
    for (let v = Math.max(0, y - kSmoothing); v <= Math.min(this.crop.height - 1, y + kSmoothing); ++v) {
      for (let u = Math.max(0, x - kSmoothing); u <= Math.min(this.crop.width - 1, x + kSmoothing); ++u) {
        const error = this.value(u, v, 3);
        if (error >= 0 && this.samplesAt(u, v) > 0) {
          sum += error * error;
          ++known;
        }
      }
    }
    return known > 0 ? Math.sqrt(sum / known) : undefined;
  }
}

export interface Histogram {
  /** The fraction of counted pixels in each bin, for red, green and blue. */
  bins: [Float32Array, Float32Array, Float32Array];
  /** log2 of the values at the outer edges of the first and last bin. Values beyond are counted in these bins. */
  least: number;
  most: number;
}

/** Counts about `samples` pixels that have samples, evenly spaced. */
export function histogramOf(film: Film, bins = 128, samples = 100_000): Histogram {
  const [least, most] = [-12, 8];
  const result: Histogram = {
    bins: [new Float32Array(bins), new Float32Array(bins), new Float32Array(bins)],
    least,
    most,
  };
  const pixels = film.crop.width * film.crop.height;
  // An odd step does not repeat columns if the width is a power of two.
  const step = Math.max(1, Math.floor(pixels / samples) | 1);
  let counted = 0;
  for (let i = 0; i < pixels; i += step) {
    ++counted;
    for (const channel of [0, 1, 2] as const) {
      const value = kHalfValues[film.rgbe[4 * i + channel]!]!;
      const at = ((Math.log2(Math.max(value, 2 ** least)) - least) / (most - least)) * bins;
      result.bins[channel][Math.min(bins - 1, Math.max(0, Math.floor(at)))]! += 1;
    }
  }
  for (const channel of result.bins) {
    channel.forEach((count, i) => (channel[i] = count / Math.max(counted, 1)));
  }
  return result;
}
