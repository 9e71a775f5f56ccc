/** Half floats (IEEE 754 binary16) as they stand in tiles. */

/** The value of a half by its bits. */
export function halfValue(bits: number): number {
  const sign = bits & 0x8000 ? -1 : 1;
  const exponent = (bits >> 10) & 0x1f;
  const fraction = bits & 0x3ff;
  if (exponent === 0) {
    return sign * fraction * 2 ** -24;
  }
  return exponent === 31 ? (fraction ? NaN : sign * Infinity) : sign * (1 + fraction / 1024) * 2 ** (exponent - 15);
}

/** All 65,536 values by their bits. */
export const kHalfValues = Float32Array.from({length: 65536}, (_, bits) => halfValue(bits));
