// Functions that tests evaluate in the browser to read pixels. Each is self-contained, because it is sent there as text.

/** In the browser: the RGBA bytes of a PNG. */
export async function pixelsOf(base64) {
  const bytes = Uint8Array.from(atob(base64), (each) => each.charCodeAt(0));
  const bitmap = await createImageBitmap(new Blob([bytes], {type: 'image/png'}));
  const context = new OffscreenCanvas(bitmap.width, bitmap.height).getContext('2d');
  context.drawImage(bitmap, 0, 0);
  return [...context.getImageData(0, 0, bitmap.width, bitmap.height).data];
}

/** In the browser: the share of bytes in which two PNGs differ. */
export async function differingShare(pngs) {
  const [a, b] = await Promise.all(
    pngs.map(async (base64) => {
      const bytes = Uint8Array.from(atob(base64), (each) => each.charCodeAt(0));
      const bitmap = await createImageBitmap(new Blob([bytes], {type: 'image/png'}));
      const context = new OffscreenCanvas(bitmap.width, bitmap.height).getContext('2d');
      context.drawImage(bitmap, 0, 0);
      return context.getImageData(0, 0, bitmap.width, bitmap.height).data;
    }),
  );
  let differing = 0;
  a.forEach((value, i) => (differing += value === b[i] ? 0 : 1));
  return a.length === b.length ? differing / a.length : 1;
}

/** In the browser: the largest difference between the viewer's middle and a picture, in 8-bit steps. */
export function worstDifference({expected, width, height}) {
  const canvas = document.querySelector('.viewer canvas');
  const gl = canvas.getContext('webgl2');
  const shown = new Uint8Array(4 * width * height);
  const [x, y] = [(canvas.width - width) / 2, (canvas.height - height) / 2];
  gl.readPixels(Math.round(x), Math.round(y), width, height, gl.RGBA, gl.UNSIGNED_BYTE, shown);
  let worst = 0;
  for (let row = 0; row < height; ++row) {
    for (let i = 0; i < 4 * width; ++i) {
      worst = Math.max(worst, Math.abs(shown[4 * width * (height - 1 - row) + i] - expected[4 * width * row + i]));
    }
  }
  return worst;
}

/** In the browser: the RGBA bytes of the viewer's middle, rows from the top, after it is fully drawn. */
export async function canvasPixels({width, height}) {
  await new Promise((resolve) => requestAnimationFrame(() => requestAnimationFrame(() => requestAnimationFrame(resolve))));
  const canvas = document.querySelector('.viewer canvas');
  const gl = canvas.getContext('webgl2');
  const shown = new Uint8Array(4 * width * height);
  gl.readPixels(Math.round((canvas.width - width) / 2), Math.round((canvas.height - height) / 2), width, height, gl.RGBA, gl.UNSIGNED_BYTE, shown);
  return Array.from({length: height}, (_, row) => [...shown.subarray(4 * width * (height - 1 - row), 4 * width * (height - row))]).flat();
}
