import {create} from '@bufbuild/protobuf';
import {expect, test} from 'vitest';
import {Film} from '../src/model/film';
import {kHalfValues, toHalf} from '../src/model/half';
import {defaultLayer, factorOf, failureOf, kAsRendered, kNoFailures, layerLabel, lightLayers, mix, parseRelight, relightText, shownLayers, withGain, withLayerFailures, type Relight} from '../src/model/layers';
import {LayerFailureSchema} from '../src/wire/lightmill/v1/web_pb';

const kCrop = {x: 60, y: 0, width: 10, height: 3};

/** Two tiles; every pixel is `rgb`, and the tiles have these samples. */
function filled(rgb: [number, number, number], samples: [number, number]): Film {
  const film = new Film(1n, kCrop);
  for (let i = 0; i < 30; ++i) {
    film.rgbe.set([...rgb.map(toHalf), toHalf(0.5)], 4 * i);
  }
  film.counts.set(samples);
  return film;
}

test('the page shows layers that are pictures, and mixes those that are light', () => {
  const layers = ['direct', 'light:key', 'light:rest', 'normal', 'features', 'id'];
  expect(shownLayers(layers)).toEqual(['denoised', 'direct', 'light:key', 'light:rest', 'normal']);
  expect(shownLayers(['normal', 'id'])).toEqual(['normal']);
  expect(lightLayers(layers)).toEqual(['light:key', 'light:rest']);
  expect(['', 'denoised', 'direct', 'light:key', 'light:rest'].map(layerLabel)).toEqual(['Beauty', 'Denoised', 'Direct light', 'Light: key', 'All other light']);
});

test('the denoised picture is shown by default, but errors, counts, comparisons and mixes are of the raw one', () => {
  const shown = shownLayers(['light:key', 'light:rest', 'features']);
  expect(defaultLayer(shown, 'color', new Map(), false)).toBe('denoised');
  expect(defaultLayer(shown, 'red', new Map(), false)).toBe('denoised');
  expect(defaultLayer(shown, 'color', new Map(), true)).toBe('');
  for (const show of ['samples', 'error', 'relative-error'] as const) {
    expect(defaultLayer(shown, show, new Map(), false)).toBe('');
  }
  expect(defaultLayer(shown, 'color', new Map([['light:key', {stops: 1, tint: [1, 1, 1]}]]), false)).toBe('');
  expect(defaultLayer(shownLayers(['normal']), 'color', new Map(), false)).toBe('');
});

test('a mix is the weighted sum of its layers, with their least sample count', () => {
  const target = new Film(1n, kCrop, 'relit');
  const layers = [
    {film: filled([1, 2, 4], [8, 16]), factor: factorOf({stops: 1, tint: [1, 0.5, 0]})},
    {film: filled([0.25, 0.25, 0.25], [32, 4]), factor: factorOf(undefined)},
    {film: filled([100, 100, 100], [64, 64]), factor: factorOf({stops: undefined, tint: [1, 1, 1]})},
  ];
  mix(target, layers, {x: 0, y: 0, width: 10, height: 3});
  for (let i = 0; i < 30; ++i) {
    expect([...target.rgbe.subarray(4 * i, 4 * i + 4)].map((bits) => kHalfValues[bits])).toEqual([2.25, 2.25, 0.25, -1]);
  }
  expect([...target.counts]).toEqual([8, 4]);
  expect(target.pixel(0, 0)).toMatchObject({samples: 8, standardError: undefined});
});

test('mixing changes only the rectangle', () => {
  const target = new Film(1n, kCrop, 'relit');
  mix(target, [{film: filled([1, 1, 1], [8, 16]), factor: [1, 1, 1]}], {x: 4, y: 1, width: 6, height: 1});
  expect([3, 4, 9].map((x) => kHalfValues[target.rgbe[4 * (10 + x)]!])).toEqual([0, 1, 1]);
  const values = target.valuesOf({x: 3, y: 0, width: 2, height: 2});
  expect([...values].map((bits) => kHalfValues[bits])).toEqual([0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, -1]);
  expect(target.rgbe[4 * 24]).toBe(0);
  expect([...target.counts]).toEqual([0, 16]);
});

test('a link restores a mix, and drops invalid entries', () => {
  const relight: Relight = new Map([
    ['light:key', {stops: 1.5, tint: [1, 1, 1]}],
    ['light:rest', {stops: undefined, tint: [1, 1, 1]}],
    ['light:a-b_C', {stops: -2, tint: [1, 0, 0]}],
  ]);
  expect(relightText(relight)).toBe('key:1.5,rest:off,a-b_C:-2~ff0000');
  expect(parseRelight(relightText(relight))).toEqual(relight);
  expect(parseRelight('key:0,x:1e9,:3,y:99,z:-99~00ff00,<b>:1')).toEqual(
    new Map([
      ['light:y', {stops: 8, tint: [1, 1, 1]}],
      ['light:z', {stops: -8, tint: [0, 1, 0]}],
    ]),
  );
  expect(withGain(relight, 'light:key', kAsRendered).has('light:key')).toBe(false);
});

test('a layer that is not sent shows the reason until it arrives', () => {
  const said = (layer: string, why: string) => create(LayerFailureSchema, {layer, why});
  expect(failureOf(kNoFailures, ['', 'depth'])).toBe('');
  const failures = withLayerFailures(kNoFailures, [said('depth', 'no room'), said('light:key', 'no room'), said('', 'gone')]);
  expect(failureOf(failures, ['depth'])).toBe('Depth cannot be shown: no room');
  expect(failureOf(failures, ['depth', 'light:key', 'normal'])).toBe('Depth, Light: key cannot be shown: no room');
  const later = withLayerFailures(failures, [said('depth', ''), said('normal', 'gone')]);
  expect(failureOf(later, ['depth'])).toBe('');
  expect([...later.keys()]).toEqual(['light:key', '', 'normal']);
  expect(withLayerFailures(later, [])).toBe(later);
});
