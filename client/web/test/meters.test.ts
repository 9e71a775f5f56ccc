import {create} from '@bufbuild/protobuf';
import {expect, test} from 'vitest';
import {labelPlaces, marksOf, projectionOf, readingTexts, withError} from '../src/model/meters';
import {PixelRectSchema} from '../src/wire/lightmill/v1/farm_pb';
import {CameraSchema, MeterSchema, SceneSchema} from '../src/wire/lightmill/v1/scene_pb';
import {MeterReadingSchema} from '../src/wire/lightmill/v1/web_pb';

const kFilm = {width: 200, height: 100, crop: undefined};
/** From (0, 0, 10) towards the origin. At distance d the film is 2 d high. */
const kCamera = create(CameraSchema, {eye: {z: 10}, lookAt: {}, up: {y: 1}, view: {case: 'verticalFovDegrees', value: 90}});

test('points are projected by similar triangles', () => {
  const project = projectionOf(kCamera, kFilm);
  expect(project([0, 0, 0])).toEqual({x: 100, y: 50});
  // At distance 10 the film's 100 pixels are 20 units high: 5 pixels a unit.
  const right = project([2, 0, 0])!;
  expect(right.x).toBeCloseTo(110, 9);
  expect(right.y).toBeCloseTo(50, 9);
  const above = project([0, 2, 5])!;
  expect(above.x).toBeCloseTo(100, 9);
  expect(above.y).toBeCloseTo(30, 9);
  expect(project([0, 0, 11])).toBeUndefined();
  expect(project([1, 0, 10])).toBeUndefined();
  const cropped = projectionOf(kCamera, {...kFilm, crop: create(PixelRectSchema, {x: 90, y: 40, width: 20, height: 20})});
  expect(cropped([0, 0, 0])).toEqual({x: 10, y: 10});
});

test('a shift moves the picture by heights of the film', () => {
  const shifted = projectionOf(create(CameraSchema, {...kCamera, shiftX: 0.25, shiftY: -0.5}), kFilm);
  expect(shifted([0, 0, 0])).toEqual({x: 75, y: 0});
});

test('a camera constant is the distance of a film of height 1', () => {
  const project = projectionOf(create(CameraSchema, {...kCamera, view: {case: 'cameraConstant', value: 0.5}}), kFilm);
  expect(project([2, 0, 0])!.x).toBeCloseTo(110, 9);
});

test('points and patches have a mark, except behind the camera', () => {
  const scene = create(SceneSchema, {
    camera: kCamera,
    meters: [
      {name: 'point', kind: {case: 'irradiance', value: {point: {}, normal: {x: 3}}}},
      {name: 'patch', kind: {case: 'patch', value: {corner: {x: -1, y: -1}, edge1: {x: 2}, edge2: {y: 2}}}},
      {name: 'behind', kind: {case: 'radiance', value: {point: {z: 20}, direction: {z: -1}}}},
      {name: 'half behind', kind: {case: 'flux', value: {patch: {corner: {}, edge1: {z: 20}, edge2: {y: 1}}}}},
    ],
  });
  const marks = marksOf(scene, kFilm);
  expect([...marks.keys()]).toEqual([0, 1]);
  expect(marks.get(0)!.at).toEqual({x: 100, y: 50});
  // 8 % of the distance of 10, whatever the normal's length.
  expect(marks.get(0)!.tip!.x).toBeCloseTo(104, 9);
  expect(marks.get(1)!.at).toEqual({x: 100, y: 50});
  expect(marks.get(1)!.outline.map(({x, y}) => [Math.round(x), Math.round(y)])).toEqual([
    [95, 55],
    [105, 55],
    [105, 45],
    [95, 45],
  ]);
});

test('readings have units, and a flux is multiplied by its area', () => {
  const reading = create(MeterReadingSchema, {samples: 4n, value: 2, halfWidth: 0.1, photometric: 200, photometricHalfWidth: 10});
  const patch = {corner: {}, edge1: {x: 2}, edge2: {y: 3}};
  expect(readingTexts(create(MeterSchema, {kind: {case: 'patch', value: patch}}), reading)).toEqual(['2.00 ± 0.10 W/m²', '200 ± 10 lx']);
  expect(readingTexts(create(MeterSchema, {kind: {case: 'flux', value: {patch}}}), reading)).toEqual(['12.00 ± 0.60 W', '1200 ± 60 lm']);
  expect(readingTexts(create(MeterSchema, {kind: {case: 'radiance', value: {}}}), create(MeterReadingSchema))).toEqual(['', '']);
});

test('values are rounded to the second digit of their error', () => {
  expect(withError(1.23456, 0.012)).toBe('1.235 ± 0.012');
  expect(withError(1234.5, 120)).toBe('1235 ± 120');
  expect(withError(0.5, 0)).toBe('0.5 ± 0');
  expect(withError(1.5e-7, 2e-9)).toBe('1.500e-07 ± 2.0e-09');
});

test('a label moves up if it would cover another', () => {
  const labels = [
    {at: {x: 10, y: 100}, text: 'first of three'},
    {at: {x: 20, y: 104}, text: 'second'},
    {at: {x: 30, y: 98}, text: 'third'},
    {at: {x: 400, y: 100}, text: 'far away'},
  ];
  expect(labelPlaces(labels).map(({y}) => y)).toEqual([100, 85, 70, 100]);
});
