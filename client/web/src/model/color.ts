/** Colours as people choose them: a swatch in sRGB and, of what may be brighter than white, how strong it is. Pure. */
import {srgbEncode, type Rgb} from './tone';

/** The inverse of srgbEncode. */
export function srgbDecode(value: number): number {
  return value <= 0.04045 ? value / 12.92 : ((value + 0.055) / 1.055) ** 2.4;
}

/** "#rrggbb" of linear values; what is beyond [0, 1] is as its end. */
export function swatchOf(rgb: Rgb): string {
  return `#${rgb.map((value) => Math.round(255 * srgbEncode(value)).toString(16).padStart(2, '0')).join('')}`;
}

/** Linear values of "#rrggbb", in six digits: finer than its 8 bits. */
export function ofSwatch(swatch: string): Rgb {
  const channel = (at: number) => Number(srgbDecode(Number.parseInt(swatch.slice(at, at + 2), 16) / 255).toPrecision(6));
  return [channel(1), channel(3), channel(5)];
}

/** A light as its strongest channel, and a colour whose strongest channel is 1; white where it is dark. */
export function strengthOf(rgb: Rgb): {strength: number; color: Rgb} {
  const strength = Math.max(...rgb);
  return strength > 0 ? {strength, color: [rgb[0] / strength, rgb[1] / strength, rgb[2] / strength]} : {strength: 0, color: [1, 1, 1]};
}

export function ofStrength(strength: number, color: Rgb): Rgb {
  const most = Math.max(...color);
  // Of black there is no colour: it is as if it were white.
  const [r, g, b] = most > 0 ? color : [1, 1, 1];
  const factor = strength / (most > 0 ? most : 1);
  return [r! * factor, g! * factor, b! * factor];
}
