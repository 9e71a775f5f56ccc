/** Colours as users choose them: an sRGB swatch and, for lights, a strength. Pure. */
import {srgbEncode, type Rgb} from './tone';

/** The inverse of srgbEncode. */
export function srgbDecode(value: number): number {
  return value <= 0.04045 ? value / 12.92 : ((value + 0.055) / 1.055) ** 2.4;
}

/** "#rrggbb" of linear values, clamped to [0, 1]. */
export function swatchOf(rgb: Rgb): string {
  return `#${rgb.map((value) => Math.round(255 * srgbEncode(value)).toString(16).padStart(2, '0')).join('')}`;
}

/** Linear values of "#rrggbb" in six digits, which is finer than 8 bits. */
export function ofSwatch(swatch: string): Rgb {
  const channel = (at: number) => Number(srgbDecode(Number.parseInt(swatch.slice(at, at + 2), 16) / 255).toPrecision(6));
  return [channel(1), channel(3), channel(5)];
}

/** Splits a light into its strongest channel and a colour with strongest channel 1. Black gives white with strength 0. */
export function strengthOf(rgb: Rgb): {strength: number; color: Rgb} {
  const strength = Math.max(...rgb);
  return strength > 0 ? {strength, color: [rgb[0] / strength, rgb[1] / strength, rgb[2] / strength]} : {strength: 0, color: [1, 1, 1]};
}

export function ofStrength(strength: number, color: Rgb): Rgb {
  const most = Math.max(...color);
  // Black has no colour, so white is used.
  const [r, g, b] = most > 0 ? color : [1, 1, 1];
  const factor = strength / (most > 0 ? most : 1);
  return [r! * factor, g! * factor, b! * factor];
}
