/** Files that the page saves. */
import type {Film} from '../model/film';
import {kHalfValues} from '../model/half';
import {displayed, type Tone} from '../model/tone';

/** Saves the displayed picture as an 8-bit PNG, without maps and zoom. */
export async function downloadPng(film: Film, tone: Tone, name: string): Promise<void> {
  const {width, height} = film.crop;
  const canvas = document.createElement('canvas');
  canvas.width = width;
  canvas.height = height;
  const image = new ImageData(width, height);
  // Tone mapping runs once for each of the 65,536 halves.
  const shown = Uint8ClampedArray.from(kHalfValues, (value) => displayed(Number.isNaN(value) ? 0 : value, tone));
  for (let i = 0; i < film.rgbe.length; i += 4) {
    image.data[i] = shown[film.rgbe[i]!]!;
    image.data[i + 1] = shown[film.rgbe[i + 1]!]!;
    image.data[i + 2] = shown[film.rgbe[i + 2]!]!;
    image.data[i + 3] = 255;
  }
  canvas.getContext('2d')!.putImageData(image, 0, 0);
  const blob = await new Promise<Blob | null>((resolve) => canvas.toBlob(resolve, 'image/png'));
  save(blob!, `${name}.png`);
}

/** Saves `content` as a file by the browser's download. */
export function save(content: Blob, name: string): void {
  const link = document.createElement('a');
  link.href = URL.createObjectURL(content);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
}
