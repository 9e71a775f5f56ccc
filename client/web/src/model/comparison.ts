/** Comparison of a picture with a reference: how both are shown, and how much they differ. */
import type {Rect} from './film';
import type {ExrPicture} from './exr';

export const kComparisons = ['picture', 'other', 'split', 'difference', 'squared-error', 'flip', 'hdr-flip'] as const;
export type Comparison = (typeof kComparisons)[number];

/** The reference of a comparison, and its display. */
export interface Against {
  /** A job, or a file that the user chose. */
  other: bigint | 'file';
  how: Comparison;
  /** The divider's position, as a fraction of the viewer's width. */
  split: number;
}

/** The constant in relMSE's denominator, as in the command line and the farm. */
export const kRelMseFloor = 0.01;

/** Linear R, G and B as planes, and which pixels count. */
export interface Measured {
  rgb: Float32Array;
  known: Uint8Array;
}

export interface PictureErrors {
  /** Mean over pixels and channels of (x−r)² / (r² + 0.01), and the same without the worst 0.1% of the pixels (rounded down). */
  relMse: number;
  relMseTrimmed: number;
  /** Σx / Σr. */
  energyRatio: number;
  /** Mean of |x−r| / (|x|+|r|), in [0, 1]; 0/0 counts as 0. */
  smape: number;
  /** The fraction of pixels that count: those with samples and finite values in both. */
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

/** For pictures of one size. Undefined if no pixel counts. */
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
  // Ascending: the worst come last, and adding small terms first keeps the sum exact.
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

/** The mean of a map over the pixels that count; 0 if there are none. */
export function meanOver(map: Float32Array, common: Uint8Array): number {
  let [sum, count] = [0, 0];
  map.forEach((value, i) => {
    sum += common[i] ? value : 0;
    count += common[i]!;
  });
  return count > 0 ? sum / count : 0;
}

/** Sets pixels that do not count to 0 in both pictures, so that maps and filters see no difference there. */
export function onlyCommon({rgb}: Measured, common: Uint8Array): Float32Array {
  return rgb.map((value, i) => (common[i % common.length] ? value : 0));
}

/**
 * The part of a file's picture at a job's crop, as an ExrPicture's `rgb`. If the window does not cover the crop but has its size, this is
 * the whole picture. Undefined otherwise.
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
