/**
 * FLIP: the visible difference between two pictures that are shown in alternation. The formulas and constants are those of
 * common/image/flip.cpp. Its header names the papers.
 */

/** Linear R, G and B as planes, rows from the top. */
export interface Planes {
  width: number;
  height: number;
  rgb: Float32Array;
}

/** Pixels per degree of visual angle for the papers' observer, at 0.7 m from a screen that is 0.7 m and 3840 pixels wide. */
export const kFlipPixelsPerDegree = 67.02064327658225;

type Color = [number, number, number];
type Plane = Float32Array;
/** Weights of odd number, centred at 0. */
type Kernel = Float32Array;

/** Contrast sensitivity as a sum of two Gaussians: [a1, b1, a2, b2]. */
type Sensitivity = [number, number, number, number];
const kSensitivities: [Sensitivity, Sensitivity, Sensitivity] = [
  [1, 0.0047, 0, 1e-5],
  [1, 0.0053, 0, 1e-5],
  [34.1, 0.04, 13.5, 0.025],
];
const kWidestGaussian = 0.04;
const kColorExponent = 0.7; // q_c
const kColorKnee = 0.4; // p_c
const kColorAtKnee = 0.95; // p_t
const kFeatureExponent = 0.5; // q_f
const kFeatureWidth = 0.082; // w, degrees
const kWhite: Color = [0.950428545, 1.0, 1.088900371]; // D65

/** Linear sRGB to CIE XYZ, relative to the white point. */
function shareOfWhite([r, g, b]: Color): Color {
  return [
    (10135552 * r + 8788810 * g + 4435075 * b) / 24577794 / kWhite[0],
    (2613072 * r + 8788810 * g + 887015 * b) / 12288897,
    (1425312 * r + 8788810 * g + 70074185 * b) / 73733382 / kWhite[2],
  ];
}

function rgbOf(x: number, y: number, z: number): Color {
  return [
    3.241003275 * x - 1.537398934 * y - 0.498615861 * z,
    -0.969224334 * x + 1.875930071 * y + 0.041554224 * z,
    0.055639423 * x - 0.204011202 * y + 1.057148933 * z,
  ];
}

/** The opponent space YCxCz, a linear CIELAB. */
function opponentOf(rgb: Color): Color {
  const [x, y, z] = shareOfWhite(rgb);
  return [116 * y - 16, 500 * (x - y), 200 * (y - z)];
}

function rgbOfOpponent([achromatic, redGreen, blueYellow]: Color): Color {
  const y = (achromatic + 16) / 116;
  return rgbOf((y + redGreen / 500) * kWhite[0], y, (y - blueYellow / 200) * kWhite[2]);
}

function labCurve(t: number): number {
  const delta = 6 / 29;
  return t > delta ** 3 ? Math.cbrt(t) : t / (3 * delta * delta) + 4 / 29;
}

/** CIELAB with the Hunt effect: colours look stronger in bright light. */
function huntLabOf(rgb: Color): Color {
  const [x, y, z] = shareOfWhite(rgb).map(labCurve) as Color;
  const lightness = 116 * y - 16;
  return [lightness, 0.01 * lightness * 500 * (x - y), 0.01 * lightness * 200 * (y - z)];
}

/** The HyAB distance, made for large colour differences, to the power q_c. */
function colorDistance(one: Color, other: Color): number {
  return (Math.abs(one[0] - other[0]) + Math.sqrt((one[1] - other[1]) ** 2 + (one[2] - other[2]) ** 2)) ** kColorExponent;
}

const kMaxDistance = colorDistance(huntLabOf([0, 1, 0]), huntLabOf([0, 0, 1]));

/** Maps distances up to p_c of the maximum (green to blue) to [0, p_t], and larger ones to the rest. */
function redistributed(distance: number): number {
  const knee = kColorKnee * kMaxDistance;
  const error =
    distance < knee
      ? (distance * kColorAtKnee) / knee
      : kColorAtKnee + ((distance - knee) / (kMaxDistance - knee)) * (1 - kColorAtKnee);
  return clamped(error);
}

function clamped(value: number): number {
  return Math.min(Math.max(value, 0), 1);
}

// ---- filters; the border is replicated ----

function filterRows(from: Plane, width: number, height: number, kernel: Kernel): Plane {
  const radius = kernel.length >> 1;
  const row = new Float32Array(width + 2 * radius);
  const out = new Float32Array(from.length);
  for (let y = 0; y < height; ++y) {
    const line = from.subarray(y * width, (y + 1) * width);
    row.fill(line[0]!, 0, radius);
    row.set(line, radius);
    row.fill(line[width - 1]!, radius + width);
    for (let x = 0; x < width; ++x) {
      let sum = 0;
      for (let k = 0; k < kernel.length; ++k) {
        sum += kernel[k]! * row[x + k]!;
      }
      out[y * width + x] = sum;
    }
  }
  return out;
}

function filterColumns(from: Plane, width: number, height: number, kernel: Kernel): Plane {
  const radius = kernel.length >> 1;
  const out = new Float32Array(from.length);
  for (let y = 0; y < height; ++y) {
    for (let k = 0; k < kernel.length; ++k) {
      const begin = Math.min(Math.max(y + k - radius, 0), height - 1) * width;
      const weight = kernel[k]!;
      for (let x = 0, to = y * width; x < width; ++x, ++to) {
        out[to] = out[to]! + weight * from[begin + x]!;
      }
    }
  }
  return out;
}

function filtered({width, height}: Planes, from: Plane, alongX: Kernel, alongY: Kernel): Plane {
  return filterColumns(filterRows(from, width, height, alongX), width, height, alongY);
}

function scaled(weights: Float64Array, factor: number): Kernel {
  return Float32Array.from(weights, (weight) => weight * factor);
}

function sumOf(weights: Float64Array): number {
  return weights.reduce((sum, weight) => sum + weight, 0);
}

/** exp(−x²/(2 σ²)) at whole x. */
function gaussian(radius: number, sigma: number): Float64Array {
  return Float64Array.from({length: 2 * radius + 1}, (_, i) => Math.exp(-((i - radius) ** 2) / (2 * sigma * sigma)));
}

/**
 * Blurs by the eye's contrast sensitivity: a₁√(π/b₁) exp(−π²x²/b₁) plus the same of 2, in two dimensions, normalised. Each of the two is
 * separable.
 */
function asSeen(size: Planes, from: Plane, [a1, b1, a2, b2]: Sensitivity, pixelsPerDegree: number): Plane {
  const radius = Math.ceil(3 * Math.sqrt(kWidestGaussian / (2 * Math.PI ** 2)) * pixelsPerDegree);
  const parts = [
    [a1, b1],
    [a2, b2],
  ]
    .filter(([a]) => a! > 0)
    .map(([a, b]) => ({factor: a! * Math.sqrt(Math.PI / b!), weights: gaussian(radius, (Math.sqrt(b! / 2) / Math.PI) * pixelsPerDegree)}));
  const total = parts.reduce((sum, {factor, weights}) => sum + factor * sumOf(weights) ** 2, 0);
  const out = new Float32Array(from.length);
  for (const {factor, weights} of parts) {
    const part = filtered(size, from, scaled(weights, factor / total), scaled(weights, 1));
    out.forEach((value, i) => (out[i] = value + part[i]!));
  }
  return out;
}

/** Lengths of the gradients that a filter finds. Positive and negative weights of `along` add up to ±1. */
function featureLengths(size: Planes, luma: Plane, along: Float64Array, across: Kernel): Plane {
  const positive = sumOf(along.map((weight) => Math.max(weight, 0)));
  const negative = sumOf(along.map((weight) => Math.max(-weight, 0)));
  const kernel = Float32Array.from(along, (weight) => weight / (weight > 0 ? positive : negative));
  const x = filtered(size, luma, kernel, across);
  const y = filtered(size, luma, across, kernel);
  return x.map((value, i) => Math.sqrt(value * value + y[i]! * y[i]!));
}

/** Edges by the first and points by the second derivative of a Gaussian (the paper's feature pipeline). */
function featuresOf(size: Planes, luma: Plane, pixelsPerDegree: number): {edges: Plane; points: Plane} {
  const sigma = 0.5 * kFeatureWidth * pixelsPerDegree;
  const radius = Math.ceil(3 * sigma);
  const weights = gaussian(radius, sigma);
  const across = scaled(weights, 1 / sumOf(weights));
  const first = weights.map((weight, i) => weight * (radius - i));
  const second = weights.map((weight, i) => weight * ((i - radius) ** 2 / (sigma * sigma) - 1));
  return {edges: featureLengths(size, luma, first, across), points: featureLengths(size, luma, second, across)};
}

/** A picture after the eye's filters. */
interface Seen {
  huntLab: Plane[];
  edges: Plane;
  points: Plane;
}

function see(picture: Planes, pixelsPerDegree: number): Seen {
  const pixels = picture.width * picture.height;
  const {rgb} = picture;
  const opponent = [0, 1, 2].map(() => new Float32Array(pixels));
  const luma = new Float32Array(pixels);
  for (let i = 0; i < pixels; ++i) {
    const color = opponentOf([rgb[i]!, rgb[pixels + i]!, rgb[2 * pixels + i]!]);
    opponent.forEach((plane, c) => (plane[i] = color[c]!));
    luma[i] = (color[0] + 16) / 116;
  }
  const huntLab = opponent.map((plane, c) => asSeen(picture, plane, kSensitivities[c]!, pixelsPerDegree));
  for (let i = 0; i < pixels; ++i) {
    const shown = rgbOfOpponent([huntLab[0]![i]!, huntLab[1]![i]!, huntLab[2]![i]!]).map(clamped) as Color;
    const color = huntLabOf(shown);
    huntLab.forEach((plane, c) => (plane[i] = color[c]!));
  }
  return {huntLab, ...featuresOf(picture, luma, pixelsPerDegree)};
}

/** For values in [0, 1]: ΔE_c^(1 − ΔE_f). */
function flipOfShown(picture: Planes, reference: Planes, pixelsPerDegree: number): Plane {
  const test = see(picture, pixelsPerDegree);
  const truth = see(reference, pixelsPerDegree);
  const colorAt = ({huntLab}: Seen, i: number): Color => [huntLab[0]![i]!, huntLab[1]![i]!, huntLab[2]![i]!];
  return test.edges.map((edgeHere, i) => {
    const color = redistributed(colorDistance(colorAt(test, i), colorAt(truth, i)));
    const edge = Math.abs(edgeHere - truth.edges[i]!);
    const point = Math.abs(test.points[i]! - truth.points[i]!);
    const feature = Math.min((Math.max(edge, point) / Math.SQRT2) ** kFeatureExponent, 1);
    return color > 0 ? color ** (1 - feature) : 0;
  });
}

/**
 * The error of every pixel, in [0, 1], for pictures of one size that are shown with an exposure in stops. Values are clamped to [0, 1]
 * after the exposure.
 */
export function flipMap(picture: Planes, reference: Planes, exposure = 0, pixelsPerDegree = kFlipPixelsPerDegree): Float32Array {
  const shown = (of: Planes): Planes => ({...of, rgb: of.rgb.map((value) => clamped(value * 2 ** exposure))});
  return flipOfShown(shown(picture), shown(reference), pixelsPerDegree);
}

// ---- exposures ----

// The ACES curve by K. Narkowicz, with its factor 0.6: (k0 x² + k1 x)/(k3 x² + k4 x + k5).
const kCurve = [0.6 * 0.6 * 2.51, 0.6 * 0.03, 0, 0.6 * 0.6 * 2.43, 0.6 * 0.59, 0.14] as const;
const kShownAs = 0.85; // the curve's output for the brightest pixel and for the median
const kMaxExposures = 64;

function toneMapped(picture: Planes, exposure: number): Planes {
  const factor = 2 ** exposure;
  const rgb = picture.rgb.map((value) => {
    const x = Math.min(Math.max(value, 0) * factor, 1e9);
    return clamped((kCurve[0] * x * x + kCurve[1] * x) / (kCurve[3] * x * x + kCurve[4] * x + kCurve[5]));
  });
  return {...picture, rgb};
}

function medianOf(sorted: Float64Array): number {
  return (sorted[(sorted.length - 1) >> 1]! + sorted[sorted.length >> 1]!) / 2;
}

/** Exposures for a reference, ascending, in stops. */
function exposuresFor({width, height, rgb}: Planes): number[] {
  const pixels = width * height;
  const light = (i: number, plane: number) => Math.max(rgb[plane * pixels + i]!, 0);
  const luminance = Float64Array.from({length: pixels}, (_, i) => 0.2126 * light(i, 0) + 0.7152 * light(i, 1) + 0.0722 * light(i, 2)).sort();
  const lit = luminance.findIndex((value) => value > 0);
  if (lit < 0) {
    return [0];
  }
  const middle = medianOf(luminance) || medianOf(luminance.subarray(lit));
  // The positive x that the curve maps to kShownAs.
  const [a, b, c] = [kCurve[0] - kCurve[3] * kShownAs, kCurve[1] - kCurve[4] * kShownAs, -kCurve[5] * kShownAs];
  const x = (-b + Math.sqrt(b * b - 4 * a * c)) / (2 * a);
  const [start, stop] = [Math.log2(x / luminance.at(-1)!), Math.log2(x / middle)];
  const count = Math.min(Math.max(Math.ceil(stop - start), 2), kMaxExposures);
  return Array.from({length: count}, (_, i) => start + ((stop - start) * i) / (count - 1));
}

/**
 * The largest error of every pixel over exposures with the ACES tone curve. They range from the exposure for the reference's brightest
 * pixel to that for its median. Negative values count as 0. If the median is 0, that of the nonzero pixels is taken. A black reference has
 * only the exposure 1.
 */
export function hdrFlipMap(picture: Planes, reference: Planes, pixelsPerDegree = kFlipPixelsPerDegree): Float32Array {
  const map = new Float32Array(picture.width * picture.height);
  for (const exposure of exposuresFor(reference)) {
    const one = flipOfShown(toneMapped(picture, exposure), toneMapped(reference, exposure), pixelsPerDegree);
    map.forEach((most, i) => (map[i] = Math.max(most, one[i]!)));
  }
  return map;
}
