import {expect, test} from 'vitest';
import {commonPixels, errorsBetween, meanOver, onlyCommon, partBelow, type Measured} from '../src/model/comparison';
import {Film} from '../src/model/film';
import {halfValue, kHalfValues, toHalf} from '../src/model/half';

function measured(rgb: number[], known?: number[]): Measured {
  return {rgb: Float32Array.from(rgb), known: Uint8Array.from(known ?? Array<number>(rgb.length / 3).fill(1))};
}

test('rounding to half keeps every half, and takes the even one at a tie', () => {
  const others = [...kHalfValues.keys()].filter((bits) => {
    const value = halfValue(bits);
    return Number.isFinite(value) && value !== 0 && toHalf(value) !== bits;
  });
  expect(others).toEqual([]);
  for (const bits of [0, 1, 2, 0x3ff, 0x400, 0x3bff, 0x3c00, 0x3c01, 0x7bfd]) {
    const [below, above] = [halfValue(bits), halfValue(bits + 1)];
    const middle = (below + above) / 2;
    expect(toHalf(middle)).toBe(bits & 1 ? bits + 1 : bits);
    expect(toHalf(middle - (above - below) / 64)).toBe(bits);
    expect(toHalf(middle + (above - below) / 64)).toBe(bits + 1);
  }
  expect(toHalf(0)).toBe(0);
  expect([1e9, -1e9, Infinity].map(toHalf)).toEqual([0x7bff, 0xfbff, 0x7bff]);
  expect(kHalfValues[toHalf(NaN)]).toBeNaN();
});

test('errors agree with their definitions', () => {
  // Two pixels: (1, 0, 0.5) for (1, 0.3, 0.5) and (2, 0, 0) for (1, 0, 0).
  const [picture, reference] = [measured([1, 2, 0, 0, 0.5, 0]), measured([1, 1, 0.3, 0, 0.5, 0])];
  const errors = errorsBetween(picture, reference, commonPixels(picture, reference))!;
  expect(errors.relMse).toBeCloseTo((0.09 / (0.09 + 0.01) + 1 / 1.01) / 6, 7);
  expect(errors.relMseTrimmed).toBeCloseTo(errors.relMse, 12);
  expect(errors.energyRatio).toBeCloseTo(3.5 / 2.8, 6);
  expect(errors.smape).toBeCloseTo((1 + 1 / 3) / 6, 7);
  expect(errors.share).toBe(1);
});

test('one pixel in a thousand is trimmed', () => {
  const n = 2000;
  const grey = (value: (i: number) => number) => measured(Array.from({length: 3 * n}, (_, i) => value(i % n)));
  const [picture, reference] = [grey((i) => (i < 3 ? 100 : 1)), grey(() => 0)];
  const errors = errorsBetween(picture, reference, commonPixels(picture, reference))!;
  expect(errors.relMse).toBeCloseTo(((n - 3) * 100 + 3 * 1e6) / n, 6);
  expect(errors.relMseTrimmed).toBeCloseTo(((n - 3) * 100 + 1e6) / (n - 2), 6);
});

test('pixels that are not finite, or without samples in one picture, do not count', () => {
  const picture = measured([1, 9, NaN, 1, 1, 9, 1, 1, 1, 9, 1, 1], [1, 1, 1, 0]);
  const reference = measured([1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1], [1, 0, 1, 1]);
  const common = commonPixels(picture, reference);
  expect([...common]).toEqual([1, 0, 0, 0]);
  expect(errorsBetween(picture, reference, common)).toMatchObject({relMse: 0, energyRatio: 1, share: 0.25});
  expect([...onlyCommon(picture, common)]).toEqual([1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0]);
  expect(meanOver(Float32Array.of(0.5, 1, 1, 1), common)).toBe(0.5);
  expect(errorsBetween(picture, reference, new Uint8Array(4))).toBeUndefined();
});

test('a file is placed by its window, else by its size', () => {
  const plane = [0, 1, 2, 3, 4, 5, 6, 7, 8];
  const file = {window: {x: -1, y: 0, width: 3, height: 3}, rgb: Float32Array.from([...plane, ...plane.map((v) => v + 10), ...plane.map((v) => v + 20)])};
  expect([...partBelow(file, {x: 0, y: 1, width: 2, height: 2})!]).toEqual([4, 5, 7, 8, 14, 15, 17, 18, 24, 25, 27, 28]);
  expect(partBelow(file, {x: 100, y: 100, width: 3, height: 3})).toBe(file.rgb);
  expect(partBelow(file, {x: 1, y: 1, width: 2, height: 2})).toBeUndefined();
});

test('a still picture has values and no errors', () => {
  const film = Film.still({x: 60, y: 0, width: 8, height: 1}, Float32Array.from({length: 24}, (_, i) => i / 8));
  expect(film.pixel(7, 0)).toMatchObject({rgb: [7 / 8, 15 / 8, 23 / 8], samples: 1, standardError: undefined});
  const {rgb, known} = film.planes();
  expect([...rgb]).toEqual(Array.from({length: 24}, (_, i) => i / 8));
  expect([...known]).toEqual(Array<number>(8).fill(1));
});
