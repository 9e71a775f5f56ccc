import {expect, test} from 'vitest';
import {ExrError, readExr} from '../src/model/exr';
import packed from './exr_files.json';

// Files of 24×19 pixels, written by the OpenEXR library with each compression, and packed by gzip. The pixel (x, y) has R = y + x/16
// in float, G = ⌊x/8⌋/4 and B = −y/8 in half, and an integer channel. The data window begins at (3, −2). The file with ZIPS has its
// lines in decreasing order.
async function file(name: keyof typeof packed): Promise<Uint8Array<ArrayBuffer>> {
  const bytes = Uint8Array.from(atob(packed[name]), (each) => each.charCodeAt(0));
  return new Uint8Array(await new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream('gzip'))).arrayBuffer());
}

test('files of each supported compression have the pixels that were written', async () => {
  for (const name of ['none', 'rle', 'zips', 'zip'] as const) {
    const {window, rgb} = await readExr(await file(name));
    expect(window, name).toEqual({x: 3, y: -2, width: 24, height: 19});
    const expected = [0, 1, 2].flatMap((plane) =>
      Array.from({length: 24 * 19}, (_, i) => {
        const [x, y] = [i % 24, Math.floor(i / 24)];
        return [y + x / 16, Math.floor(x / 8) / 4, y ? -y / 8 : 0][plane];
      }),
    );
    expect([...rgb], name).toEqual(expected);
  }
});

test('a file that is not supported is refused with the reason', async () => {
  const message = (bytes: Uint8Array<ArrayBuffer>) => readExr(bytes).then(() => 'it was read', (error: Error) => (error instanceof ExrError ? error.message : `unexpected ${error}`));
  expect(await message(await file('piz'))).toMatch(/PIZ is not supported: save it with ZIP/);
  expect(await message(new Uint8Array([1, 2, 3]))).toBe('this is not an EXR file');
  const tiled = await file('zip');
  tiled[5] = 2;
  expect(await message(tiled)).toMatch(/tiled/);
});

test('a file that is cut short is refused, and one with a changed byte is refused or read', async () => {
  for (const name of ['none', 'rle', 'zip'] as const) {
    const whole = await file(name);
    for (let length = 0; length < whole.length; length += 37) {
      await expect(readExr(whole.slice(0, length)), `${name} of ${length} bytes`).rejects.toBeInstanceOf(ExrError);
    }
    for (let at = 0; at < whole.length; at += 13) {
      const changed = whole.slice();
      changed[at] = changed[at]! ^ 0xff;
      const outcome = await readExr(changed).catch((error: unknown) => error);
      expect(outcome instanceof ExrError || (outcome as {rgb?: unknown}).rgb instanceof Float32Array, `${name} with byte ${at} changed: ${outcome}`).toBe(true);
    }
  }
});
