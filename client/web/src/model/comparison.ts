/** A picture beside another that it is measured by: how the two are shown, and how far they are apart. */
import type {Rect} from './film';
import type {ExrPicture} from './exr';

export const kComparisons = ['picture', 'other', 'split', 'difference', 'squared-error', 'flip', 'hdr-flip'] as const;
export type Comparison = (typeof kComparisons)[number];

/** What a job is compared with, and how that is shown. */
export interface Against {
  /** A job, or a file that the reader chose. */
  other: bigint | 'file';
  how: Comparison;
  /** Where the divider stands, as a share of the viewer's width. */
  split: number;
}

/** The floor in relMSE's denominator: that of the command line and of the farm. */
export const kRelMseFloor = 0.01;

/** Linear R, G and B, one after the other, and which pixels count. */
export interface Measured {
  rgb: Float32Array;
  known: Uint8Array;
}

export interface PictureErrors {
  /** Mean over pixels and channels of (x−r)² / (r² + 0.01), and without the worst 0.1 % of the pixels (rounded down). */
  relMse: number;
  relMseTrimmed: number;
  /** Σx / Σr. */
  energyRatio: number;
  /** Mean of |x−r| / (|x|+|r|), in [0, 1]; 0/0 counts as 0. */
  smape: number;
  /** Of the pixels, that count: where both have samples and finite values. */
  share: number;
}

/** Which pixels count in both and are finite. */
export function commonPixels(picture: Measured, reference: Measured): Uint8Array {
  const pixels = picture.known.length;
  return picture.known.map((known, i) => {
    const finite = [picture, reference].every(({rgb}) => Number.isFinite(rgb[i]! + rgb[pixels + i]! + rgb[2 * pixels + i]!));
    return known && reference.known[i] && finite ? 1 : 0;
  });
}

/** Of pictures of one size; undefined where no pixel counts. */
export function errorsBetween(picture: Measured, reference: Measured, common: Uint8Array): PictureErrors | undefined {
  const pixels = common.length;
  const squares: number[] = [];
  let [sumX, sumR, smape] = [0, 0, 0];
  for (let i = 0; i < pixels; ++i) {
    if (!common[i]) {
      continue;
    }
    let square = 0;
    for (let at = i; at < 3 * pixels; at += pixels) {
      const [x, r] = [picture.rgb[at]!, reference.rgb[at]!];
      const distance = Math.abs(x - r);
      square += (distance * distance) / (r * r + kRelMseFloor) / 3;
      smape += distance > 0 ? distance / (Math.abs(x) + Math.abs(r)) : 0;
      sumX += x;
      sumR += r;
    }
    squares.push(square);
  }
  if (squares.length === 0) {
    return undefined;
  }
  // Ascending: the worst come last, and small terms first keep the sum exact.
  const sorted = Float64Array.from(squares).sort();
  const kept = sorted.length - Math.floor(sorted.length / 1000);
  const sum = (part: Float64Array) => part.reduce((total, value) => total + value, 0);
  const trimmed = sum(sorted.subarray(0, kept));
  return {
    relMse: (trimmed + sum(sorted.subarray(kept))) / sorted.length,
    relMseTrimmed: trimmed / kept,
    energyRatio: sumX === sumR ? 1 : sumX / sumR,
    smape: smape / (3 * sorted.length),
    share: sorted.length / pixels,
  };
}

/** The mean of a map over what counts; 0 where nothing does. */
export function meanOver(map: Float32Array, common: Uint8Array): number {
  let [sum, count] = [0, 0];
  map.forEach((value, i) => {
    sum += common[i] ? value : 0;
    count += common[i]!;
  });
  return count > 0 ? sum / count : 0;
}

/** 0 in both pictures where a pixel does not count: maps have no error there, and neighbours see none. */
export function onlyCommon({rgb}: Measured, common: Uint8Array): Float32Array {
  return rgb.map((value, i) => (common[i % common.length] ? value : 0));
}

/**
 * The part of a file's picture that lies below a job's crop, as an ExrPicture's `rgb`: where its window covers the crop, else, of the
 * same size, as it is. Undefined where neither is so.
 */
export function partBelow({window, rgb}: ExrPicture, crop: Rect): Float32Array | undefined {
  const covers =
    window.x <= crop.x &&
    window.y <= crop.y &&
    window.x + window.width >= crop.x + crop.width &&
    window.y + window.height >= crop.y + crop.height;
  if (!covers) {
    return window.width === crop.width && window.height === crop.height ? rgb : undefined;
  }
  const pixels = crop.width * crop.height;
  const part = new Float32Array(3 * pixels);
  for (let plane = 0; plane < 3; ++plane) {
    for (let y = 0; y < crop.height; ++y) {
      const from = plane * window.width * window.height + (crop.y - window.y + y) * window.width + crop.x - window.x;
      part.set(rgb.subarray(from, from + crop.width), plane * pixels + y * crop.width);
    }
  }
  return part;
}
