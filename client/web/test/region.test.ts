import {create} from '@bufbuild/protobuf';
import {expect, test} from 'vitest';
import {Film} from '../src/model/film';
import {toHalf} from '../src/model/half';
import {movedRegion, regionBetween, regionStatistics, selected, within} from '../src/model/region';
import {PixelRectSchema} from '../src/wire/lightmill/v1/farm_pb';
import {ViewTileSchema} from '../src/wire/lightmill/v1/web_pb';

/** A film of one row whose tile has these pixels: R, G, B, E. */
function filmOf(pixels: number[][], samples: bigint): Film {
  const film = new Film(7n, {x: 0, y: 0, width: pixels.length, height: 1});
  const rgbe = new Uint8Array(Uint16Array.from(pixels.flat(), toHalf).buffer);
  film.put(create(ViewTileSchema, {job: 7n, rect: create(PixelRectSchema, {x: 0, y: 0, width: pixels.length, height: 1}), samples, rgbe}));
  return film;
}

test('the value of a rank agrees with sorting', () => {
  for (const length of [1, 2, 3, 10, 101]) {
    // All orders of few values come up: 31 is a generator modulo 101.
    const values = Float32Array.from({length}, (_, i) => (31 * i + 7) % 101 % 17);
    const sorted = values.slice().sort();
    expect([...sorted.keys()].map((rank) => selected(values.slice(), rank))).toEqual([...sorted]);
  }
});

test('statistics agree with their definitions', () => {
  const film = filmOf([[9, 9, 9, 9], [1, 0, 0, 0.5], [2, 0, 0, 1], [4, 0, 8, 0.25], [5, 0, 0, 0]], 12n);
  const found = regionStatistics(film, {x: 1, y: 0, width: 4, height: 1})!;
  expect(found.red).toEqual({mean: 3, median: 3, least: 1, most: 5, variance: 2.5});
  expect(found.green).toEqual({mean: 0, median: 0, least: 0, most: 0, variance: 0});
  expect(found.blue).toEqual({mean: 2, median: 0, least: 0, most: 8, variance: 12});
  expect(found.luminance.mean).toBeCloseTo(0.2126 * 3 + 0.0722 * 2, 6);
  expect(found.standardError).toBeCloseTo(Math.sqrt(0.25 + 1 + 0.0625) / 4, 12);
  expect(found.samples).toEqual({least: 12, most: 12, total: 48});
  expect(regionStatistics(film, {x: 1, y: 0, width: 3, height: 1})!.red.median).toBe(2);
});

test('a region without samples has no statistics, and one without halves has no error', () => {
  const film = filmOf([[1, 1, 1, -1], [3, 3, 3, 1]], 4n);
  expect(regionStatistics(film, {x: 0, y: 0, width: 2, height: 1})).toMatchObject({pixels: 2, standardError: undefined});
  expect(regionStatistics(new Film(7n, {x: 0, y: 0, width: 2, height: 1}), {x: 0, y: 0, width: 2, height: 1})).toBeUndefined();
});

test('regions lie within the picture', () => {
  const picture = {width: 100, height: 50};
  expect(regionBetween({x: 10.7, y: 20.2}, {x: 8.1, y: 20.9}, picture)).toEqual({x: 8, y: 20, width: 3, height: 1});
  expect(regionBetween({x: -5, y: -5}, {x: 1000, y: 3}, picture)).toEqual({x: 0, y: 0, width: 100, height: 4});
  expect(regionBetween({x: -5, y: 3}, {x: -1, y: 9}, picture)).toBeUndefined();
  expect(within({x: 90, y: 40, width: 20, height: 20}, picture)).toEqual({x: 90, y: 40, width: 10, height: 10});
  const region = {x: 90, y: 40, width: 8, height: 8};
  expect(movedRegion(region, {x: 10}, picture)).toEqual({...region, x: 92});
  expect(movedRegion(region, {width: -20, height: 100}, picture)).toEqual({x: 90, y: 0, width: 1, height: 50});
});
