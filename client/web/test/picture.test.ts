import {create} from '@bufbuild/protobuf';
import {expect, test} from 'vitest';
import {fit, kMaxZoom, pan, toPicture, toScreen, zoomAt} from '../src/model/camera';
import {Film, histogramOf} from '../src/model/film';
import {halfValue, kHalfValues} from '../src/model/half';
import {displayed, exposureFor, filmicCurve, luminance, srgbEncode} from '../src/model/tone';
import {JobSchema, JobState, PixelRectSchema} from '../src/wire/lightmill/v1/farm_pb';
import {ViewTileSchema, type ViewTile} from '../src/wire/lightmill/v1/web_pb';

const kOne = 0x3c00;
const kTwo = 0x4000;
const kMinusOne = 0xbc00;

function tile(x: number, y: number, width: number, height: number, rgbe: number[], samples = 4): ViewTile {
  const halves = new Uint16Array(4 * width * height);
  halves.forEach((_, i) => (halves[i] = rgbe[i % 4]!));
  return create(ViewTileSchema, {
    job: 7n,
    rect: create(PixelRectSchema, {x, y, width, height}),
    samples: BigInt(samples),
    rgbe: new Uint8Array(halves.buffer),
  });
}

test('halves have the values of IEEE 754', () => {
  expect(halfValue(0)).toBe(0);
  expect(halfValue(kOne)).toBe(1);
  expect(halfValue(kMinusOne)).toBe(-1);
  expect(halfValue(0x7bff)).toBe(65504);
  expect(halfValue(1)).toBe(2 ** -24);
  expect(halfValue(0x3555)).toBeCloseTo(1 / 3, 3);
  expect(halfValue(0x7c00)).toBe(Infinity);
  expect(halfValue(0x7e00)).toBeNaN();
  expect(kHalfValues.length).toBe(65536);
});

test("a film belongs to its job in every state, and not to another farm's job of the same number", () => {
  const job = create(JobSchema, {id: 7n, width: 4, height: 4, traceId: new Uint8Array([1, 2]), submittedUnixMs: 5n});
  const film = Film.of(job);
  expect(film.isOf({...job, state: JobState.DONE, name: 'renamed'})).toBe(true);
  expect(film.isOf({...job, id: 8n})).toBe(false);
  expect(film.isOf({...job, traceId: new Uint8Array([1, 3])})).toBe(false);
  expect(film.isOf({...job, submittedUnixMs: 6n})).toBe(false);
});

test('tiles are placed relative to the crop', () => {
  // The crop begins 10 pixels before a tile's edge.
  const film = new Film(7n, {x: 54, y: 0, width: 30, height: 4});
  expect([film.columns, film.rows]).toEqual([2, 1]);
  expect(film.put(tile(54, 0, 10, 4, [kOne, kTwo, 0, kMinusOne], 3))?.rect).toEqual({x: 0, y: 0, width: 10, height: 4});
  expect(film.put(tile(64, 0, 20, 4, [kTwo, kTwo, kTwo, kOne], 5))?.rect.x).toBe(10);
  expect(film.pixel(9, 3)).toMatchObject({rgb: [1, 2, 0], samples: 3});
  expect(film.pixel(10, 0)).toMatchObject({rgb: [2, 2, 2], samples: 5});
  expect(film.pixel(30, 0)).toBeUndefined();
  expect(film.mostSamples()).toBe(5);
});

test('tiles of other jobs, places and sizes are ignored', () => {
  const film = new Film(7n, {x: 0, y: 0, width: 64, height: 64});
  expect(film.put({...tile(0, 0, 64, 64, [0, 0, 0, 0]), job: 8n})).toBeUndefined();
  expect(film.put(tile(64, 0, 64, 64, [0, 0, 0, 0]))).toBeUndefined();
  expect(film.put({...tile(0, 0, 64, 64, [0, 0, 0, 0]), rgbe: new Uint8Array(8)})).toBeUndefined();
  expect(film.mostSamples()).toBe(0);
});

test('the standard error is the root mean square of the known ones around the pixel', () => {
  const film = new Film(7n, {x: 0, y: 0, width: 128, height: 1});
  film.put(tile(0, 0, 64, 1, [kOne, kOne, kOne, kOne]));
  film.put(tile(64, 0, 64, 1, [kOne, kOne, kOne, kMinusOne]));
  expect(film.pixel(0, 0)?.standardError).toBe(1);
  expect(film.pixel(66, 0)?.standardError).toBe(1);
  expect(film.pixel(100, 0)?.standardError).toBeUndefined();
  film.put(tile(64, 0, 64, 1, [kOne, kOne, kOne, 0x4200]));
  // Four pixels of error 1 on one side, five of error 3 on the other.
  expect(film.pixel(64, 0)?.standardError).toBeCloseTo(Math.sqrt((4 * 1 + 5 * 9) / 9), 12);
});

test('the histogram counts each pixel once', () => {
  const film = new Film(7n, {x: 0, y: 0, width: 64, height: 64});
  film.put(tile(0, 0, 64, 64, [kOne, kTwo, 0, 0]));
  const {bins, least, most} = histogramOf(film, 20);
  expect(most - least).toBe(20);
  bins.forEach((channel) => expect(channel.reduce((sum, share) => sum + share, 0)).toBeCloseTo(1, 6));
  expect(bins[0][12]).toBe(1);
  expect(bins[1][13]).toBe(1);
  expect(bins[2][0]).toBe(1);
});

test('sRGB and the filmic curve have their published values', () => {
  expect(srgbEncode(0.5)).toBeCloseTo(0.735357, 6);
  expect(srgbEncode(0.0031308)).toBeCloseTo(0.04045, 5);
  expect(srgbEncode(2)).toBeCloseTo(1, 12);
  expect(srgbEncode(-1)).toBe(0);
  expect(filmicCurve(1)).toBeCloseTo((2.51 + 0.03) / (2.43 + 0.59 + 0.14), 12);
  expect(filmicCurve(1000)).toBe(1);
  expect(luminance([1, 1, 1])).toBeCloseTo(1, 12);
});

test('a stop doubles the value, and gamma lifts dark values', () => {
  expect(displayed(0.25, {exposure: 1, view: 'plain', gamma: 1})).toBe(displayed(0.5, {exposure: 0, view: 'plain', gamma: 1}));
  expect(displayed(0.25, {exposure: 0, view: 'plain', gamma: 2})).toBe(displayed(0.5, {exposure: 0, view: 'plain', gamma: 1}));
  expect(displayed(5, {exposure: 0, view: 'plain', gamma: 1})).toBe(255);
});

test('the automatic exposure makes the brightest values white', () => {
  expect(exposureFor(Float32Array.from({length: 200}, () => 0.25))).toBe(2);
  expect(exposureFor(new Float32Array(10))).toBe(0);
});

test('zoom keeps the point under the pointer', () => {
  const screen = {width: 800, height: 600};
  const camera = fit({width: 512, height: 512}, screen);
  expect(camera.zoom).toBeCloseTo(600 / 512, 12);
  const at = {x: 123, y: 456};
  const zoomed = zoomAt(camera, screen, at, 2);
  expect(zoomed.zoom).toBeCloseTo(2 * camera.zoom, 12);
  expect(toPicture(zoomed, screen, at).x).toBeCloseTo(toPicture(camera, screen, at).x, 9);
  expect(toScreen(zoomed, screen, toPicture(zoomed, screen, at)).y).toBeCloseTo(at.y, 9);
  expect(zoomAt(camera, screen, at, 1e9).zoom).toBe(kMaxZoom);
});

test('the picture stays partly visible', () => {
  const moved = pan({zoom: 2, center: {x: 5, y: 5}}, {width: 10, height: 10}, {x: 1000, y: -4});
  expect(moved.center).toEqual({x: 0, y: 7});
});
