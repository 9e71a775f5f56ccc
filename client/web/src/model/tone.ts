/** The display of linear radiance. The formulas are those of the command line's PNG files and of the viewer's shader. */

export type Rgb = [number, number, number];
export type View = 'plain' | 'filmic';

export interface Tone {
  /** Values are first multiplied by 2^exposure. */
  exposure: number;
  view: View;
  /** Displayed values are raised to 1/gamma before the sRGB curve. */
  gamma: number;
  /** Shows values from -1 to 1 from black to white without other steps, for directions. */
  signed?: boolean;
}

/** Rec. 709. */
export function luminance(rgb: Rgb): number {
  return 0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2];
}

/** The sRGB transfer function (IEC 61966-2-1); clamps to [0, 1]. */
export function srgbEncode(linear: number): number {
  const value = Math.min(Math.max(linear, 0), 1);
  return value <= 0.0031308 ? 12.92 * value : 1.055 * value ** (1 / 2.4) - 0.055;
}

/** K. Narkowicz's fit of the ACES reference tone curve (2015), clamped to [0, 1]. */
export function filmicCurve(linear: number): number {
  const x = Math.max(linear, 0);
  return Math.min((x * (2.51 * x + 0.03)) / (x * (2.43 * x + 0.59) + 0.14), 1);
}

/** One channel, to [0, 255]. */
export function displayed(linear: number, tone: Tone): number {
  if (tone.signed) {
    return Math.round(255 * Math.min(Math.max(0.5 * linear + 0.5, 0), 1));
  }
  const exposed = linear * 2 ** tone.exposure;
  const shown = tone.view === 'filmic' ? filmicCurve(exposed) : Math.min(Math.max(exposed, 0), 1);
  return Math.round(255 * srgbEncode(shown ** (1 / tone.gamma)));
}

/** The stops that bring the 99th percentile of `values` to 1; 0 if all are black. */
export function exposureFor(values: Float32Array): number {
  const sorted = values.filter((value) => value > 0).sort();
  const high = sorted[Math.floor(sorted.length * 0.99)];
  return high === undefined ? 0 : Math.round(-Math.log2(high) * 4) / 4;
}
