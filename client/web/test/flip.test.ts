// FLIP against the values of tests/unit/image/flip_test.cpp, which another program computed from the formulas in float64. Features are the
// root of a difference, so rounding to float32 shows in the fourth digit.
import {expect, test} from 'vitest';
import {flipMap, hdrFlipMap, type Planes} from '../src/model/flip';

function uniform(...color: [number, number, number]): Planes {
  const [width, height] = [12, 9];
  return {width, height, rgb: Float32Array.from({length: 3 * width * height}, (_, i) => color[Math.floor(i / (width * height))]!)};
}

/** ((7x + 13y + 5c + shift) mod 11)/16 + ⌊x/8⌋/8, times `scale`(x); `shift` is (x + y) mod 3 in the test picture. */
function pattern(test: boolean, scale: (x: number) => number): Planes {
  const [width, height] = [24, 18];
  const rgb = Float32Array.from({length: 3 * width * height}, (_, i) => {
    const [x, y, c] = [i % width, Math.floor(i / width) % height, Math.floor(i / (width * height))];
    const number = (7 * x + 13 * y + 5 * c + (test ? (x + y) % 3 : 0)) % 11;
    return (number / 16 + Math.floor(x / 8) / 8) * scale(x);
  });
  return {width, height, rgb};
}

const mean = (map: Float32Array) => map.reduce((sum, value) => sum + value, 0) / map.length;
const between = (picture: Planes, reference: Planes) => mean(flipMap(picture, reference));
const near = (value: number | undefined, expected: number) => expect(Math.abs(value! - expected), `${value} for ${expected}`).toBeLessThan(1e-4);

test('the error between uniform colours is their distance in the colour metric', () => {
  near(between(uniform(0, 0, 0), uniform(1, 1, 1)), 0.95 + (0.05 * (100 ** 0.7 - 0.4 * 41.2760984)) / (0.6 * 41.2760984));
  near(between(uniform(0, 1, 0), uniform(0, 0, 1)), 1);
  near(between(uniform(0.5, 0.5, 0.5), uniform(0.25, 0.25, 0.25)), 0.4518496);
  near(between(uniform(1, 0, 0), uniform(0.5, 0.1, 0.2)), 0.8100855);
  expect(between(uniform(0.3, 0.2, 0.7), uniform(0.3, 0.2, 0.7))).toBe(0);
  expect(between(uniform(2, -1, 7), uniform(1, 0, 1))).toBe(0);
});

test('errors of patterns agree with the formulas', () => {
  const [picture, reference] = [pattern(true, () => 1), pattern(false, () => 1)];
  const map = flipMap(picture, reference);
  near(mean(map), 0.2454295);
  near(map[0], 0.1907135);
  near(map[9 * 24 + 11], 0.2432766);
  near(map[17 * 24 + 23], 0.2056899);
  const fromAfar = flipMap(picture, reference, 0, 20);
  near(mean(fromAfar), 0.4069033);
  near(fromAfar[9 * 24 + 11], 0.3650521);
  expect(flipMap(reference, picture)).toEqual(map);
});

test('an exposure of one stop equals pictures of twice the brightness', () => {
  const [half, whole] = [(test: boolean) => pattern(test, () => 0.5), (test: boolean) => pattern(test, () => 1)];
  expect(flipMap(half(true), half(false), 1)).toEqual(flipMap(whole(true), whole(false)));
});

test('the HDR error is the greatest over the exposures', () => {
  const scale = (x: number) => 2 ** (Math.floor(x / 6) * 2 - 3);
  const map = hdrFlipMap(pattern(true, scale), pattern(false, scale));
  near(mean(map), 0.19885);
  near(map[9 * 24 + 11], 0.2006224);
  near(map[17 * 24 + 23], 0.0901522);
  const black = uniform(0, 0, 0);
  expect(mean(hdrFlipMap(black, black))).toBe(0);
  expect(mean(hdrFlipMap(uniform(1, 1, 1), black))).toBeGreaterThan(0.9);
});
