/** Statistics of a rectangle of a film. */
import type {Size} from './camera';
import type {Film, Rect} from './film';
import {kHalfValues} from './half';
import {luminance} from './tone';

export interface Spread {
  mean: number;
  median: number;
  least: number;
  most: number;
  /** The standard deviation of the pixels' values. */
  variance: number;
}

export interface RegionStatistics {
  /** Pixels with samples and finite values. The others are ignored. */
  pixels: number;
  red: Spread;
  green: Spread;
  blue: Spread;
  luminance: Spread;
  /**
   * The standard error of the mean luminance: √Σe²/pixels, where e² is the variance of a pixel's mean, estimated from its two halves. The
   * pixels' errors are taken as independent. Undefined while a half is missing.
   */
  standardError: number | undefined;
  /** Per pixel, and the total over all pixels. */
  samples: {least: number; most: number; total: number};
}

/** The value with `rank` others before it in ascending order. Reorders `values`. */
export function selected(values: Float32Array, rank: number): number {
  let [low, high] = [0, values.length - 1];
  while (low < high) {
    const pivot = values[(low + high) >> 1]!;
    let [i, j] = [low, high];
    while (i <= j) {
      while (values[i]! < pivot) {
        ++i;
      }
      while (values[j]! > pivot) {
        --j;
      }
      if (i <= j) {
        [values[i], values[j]] = [values[j]!, values[i]!];
        ++i;
        --j;
      }
    }
    if (rank <= j) {
      high = j;
    } else if (rank >= i) {
      low = i;
    } else {
      break;
    }
  }
  return values[rank]!;
}

/** Needs at least one value. */
function spreadOf(values: Float32Array): Spread {
  const mean = values.reduce((sum, value) => sum + value, 0) / values.length;
  const squares = values.reduce((sum, value) => sum + (value - mean) ** 2, 0);
  const [least, most] = values.reduce(([a, b], value) => [Math.min(a, value), Math.max(b, value)], [Infinity, -Infinity]);
  const upper = selected(values, values.length >> 1);
  const median = values.length & 1 ? upper : (selected(values, (values.length >> 1) - 1) + upper) / 2;
  return {mean, median, least, most, variance: squares / values.length};
}

/** The part of a region inside a picture; undefined if it is empty. */
export function within(region: Rect, picture: Size): Rect | undefined {
  const [x, y] = [Math.max(0, region.x), Math.max(0, region.y)];
  const width = Math.min(region.x + region.width, picture.width) - x;
  const height = Math.min(region.y + region.height, picture.height) - y;
  return width > 0 && height > 0 ? {x, y, width, height} : undefined;
}

/** The rectangle between two points of a picture, both included. */
export function regionBetween(a: {x: number; y: number}, b: {x: number; y: number}, picture: Size): Rect | undefined {
  const [x, y] = [Math.floor(Math.min(a.x, b.x)), Math.floor(Math.min(a.y, b.y))];
  const [right, bottom] = [Math.floor(Math.max(a.x, b.x)), Math.floor(Math.max(a.y, b.y))];
  return within({x, y, width: right - x + 1, height: bottom - y + 1}, picture);
}

/** Moves or grows a region by whole pixels. It stays within the picture and has at least one pixel. */
export function movedRegion(region: Rect, by: Partial<Rect>, picture: Size): Rect {
  const clamp = (value: number, least: number, most: number) => Math.min(Math.max(value, least), most);
  const width = clamp(region.width + (by.width ?? 0), 1, picture.width);
  const height = clamp(region.height + (by.height ?? 0), 1, picture.height);
  return {
    x: clamp(region.x + (by.x ?? 0), 0, picture.width - width),
    y: clamp(region.y + (by.y ?? 0), 0, picture.height - height),
    width,
    height,
  };
}

/** Undefined if no pixel of the region has samples. `region` lies within the film. */
export function regionStatistics(film: Film, region: Rect): RegionStatistics | undefined {
  const size = region.width * region.height;
  const channels = [0, 1, 2, 3].map(() => new Float32Array(size));
  let [pixels, squares, known] = [0, 0, 0];
  const samples = {least: Infinity, most: 0, total: 0};
  for (let y = region.y; y < region.y + region.height; ++y) {
    for (let x = region.x; x < region.x + region.width; ++x) {
      const at = 4 * (y * film.crop.width + x);
      const count = film.samplesAt(x, y);
      const rgb = [0, 1, 2].map((channel) => kHalfValues[film.rgbe[at + channel]!]!) as [number, number, number];
      if (count === 0 || !rgb.every(Number.isFinite)) {
        continue;
      }
      [...rgb, luminance(rgb)].forEach((value, channel) => (channels[channel]![pixels] = value));
      ++pixels;
      samples.least = Math.min(samples.least, count);
      samples.most = Math.max(samples.most, count);
      samples.total += count;
      const error = kHalfValues[film.rgbe[at + 3]!]!;
      if (error >= 0) {
        squares += error * error;
        ++known;
      }
    }
  }
  if (pixels === 0) {
    return undefined;
  }
  const [red, green, blue, light] = channels.map((values) => spreadOf(values.subarray(0, pixels)));
  const standardError = known === pixels ? Math.sqrt(squares) / pixels : undefined;
  return {pixels, red: red!, green: green!, blue: blue!, luminance: light!, standardError, samples};
}
