/** Half floats (IEEE 754 binary16), as in tiles. */

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

/** All 65,536 values, indexed by their bits. */
export const kHalfValues = Float32Array.from({length: 65536}, (_, bits) => halfValue(bits));

const kBits = new Uint32Array(1);
const kAsFloat = new Float32Array(kBits.buffer);

/** The bits of the half nearest to `value`, ties to even. Values beyond ±65504 become ±65504, as in tiles. */
export function toHalf(value: number): number {
  if (Number.isNaN(value)) {
    return 0x7e00;
  }
  kAsFloat[0] = Math.min(Math.abs(value), 65504);
  const sign = value < 0 ? 0x8000 : 0;
  const bits = kBits[0]!;
  const exponent = (bits >>> 23) - 127;
  if (exponent < -14) {
    // A multiple of 2^-24, which a float holds exactly if the half does.
    const units = kAsFloat[0]! * 2 ** 24;
    const whole = Math.floor(units);
    const rest = units - whole;
    return sign | (whole + (rest > 0.5 || (rest === 0.5 && whole & 1) ? 1 : 0));
  }
  const kept = ((exponent + 15) << 10) | ((bits >>> 13) & 0x3ff);
  const rest = bits & 0x1fff;
  return sign | (kept + (rest > 0x1000 || (rest === 0x1000 && kept & 1) ? 1 : 0));
}
