/** The shader of the viewer: tone, maps and comparisons of films in half-float textures. */
import {kComparisons, kRelMseFloor} from '../model/comparison';
import {kSmoothing} from '../model/film';
import {kShows} from '../model/route';

export const kVertex = `#version 300 es
void main() {
  vec2 corner = vec2(gl_VertexID & 1, gl_VertexID >> 1) * 4.0 - 1.0;
  gl_Position = vec4(corner, 0.0, 1.0);
}`;

export const kFragment = `#version 300 es
precision highp float;
precision highp sampler2D;
uniform sampler2D film;        // R, G, B and the standard error of the luminance; -1 where it is unknown
uniform sampler2D counts;      // samples per pixel, by tile
uniform sampler2D otherFilm;   // the film to compare with
uniform sampler2D otherCounts;
uniform sampler2D errorMap;    // difference of the two, in [0, 1]
uniform sampler2D photonMap;        // photons' colours, 0 without photons
uniform bool showPhotons;
uniform vec2 filmSize;         // pixels
uniform vec2 tileOrigin;       // of the first pixel within its tile
uniform vec2 otherOrigin;
uniform vec2 screenSize;     // device pixels
uniform vec2 center;         // the film's point in the middle of the screen
uniform float zoom;          // device pixels per pixel of the film
uniform float exposure, gamma;
uniform int view, show, how;
uniform bool directions;     // values from -1 to 1
uniform float splitAt;       // device pixels from the left
uniform float mostSamples;
uniform vec3 background;
out vec4 shown;

const vec3 kLuminance = vec3(0.2126, 0.7152, 0.0722);
const int kMaxTaps = 8;

float samplesAt(bool other, ivec2 pixel) {
  return other ? texelFetch(otherCounts, (pixel + ivec2(otherOrigin)) / 64, 0).r
               : texelFetch(counts, (pixel + ivec2(tileOrigin)) / 64, 0).r;
}

vec4 filmAt(bool other, ivec2 at) {
  return other ? texelFetch(otherFilm, at, 0) : texelFetch(film, at, 0);
}

const int kDifference = ${kComparisons.indexOf('difference')}, kSquaredError = ${kComparisons.indexOf('squared-error')};

// The value of one pixel: of one of the films, or their difference.
vec3 valueAt(bool other, ivec2 at) {
  if (how < kDifference) {
    return filmAt(other, at).rgb;
  }
  if (how > kSquaredError) {
    return texelFetch(errorMap, at, 0).rrr;
  }
  vec3 reference = filmAt(true, at).rgb;
  vec3 distance = abs(filmAt(false, at).rgb - reference);
  return how == kDifference ? distance : distance * distance / (reference * reference + ${kRelMseFloor});
}

// The mean over the film's pixels below one pixel of the screen.
vec3 colorAt(bool other, vec2 at) {
  float width = 1.0 / zoom;
  if (width <= 1.0) {
    return valueAt(other, ivec2(at));
  }
  int taps = min(int(ceil(width)), kMaxTaps);
  vec3 sum = vec3(0.0);
  for (int y = 0; y < taps; ++y) {
    for (int x = 0; x < taps; ++x) {
      vec2 offset = (vec2(x, y) + 0.5) / float(taps) - 0.5;
      sum += valueAt(other, ivec2(clamp(at + offset * width, vec2(0.0), filmSize - 1.0)));
    }
  }
  return sum / float(taps * taps);
}

float standardErrorAt(bool other, ivec2 pixel) {
  float sum = 0.0, known = 0.0;
  for (int y = -${kSmoothing}; y <= ${kSmoothing}; ++y) {
    for (int x = -${kSmoothing}; x <= ${kSmoothing}; ++x) {
      ivec2 at = pixel + ivec2(x, y);
      if (any(lessThan(at, ivec2(0))) || any(greaterThanEqual(at, ivec2(filmSize)))) {
        continue;
      }
      float error = filmAt(other, at).a;
      if (error >= 0.0 && samplesAt(other, at) > 0.0) {
        sum += error * error;
        known += 1.0;
      }
    }
  }
  return known > 0.0 ? sqrt(sum / known) : -1.0;
}

float encoded(float linear) {
  float value = clamp(linear, 0.0, 1.0);
  return value <= 0.0031308 ? 12.92 * value : 1.055 * pow(value, 1.0 / 2.4) - 0.055;
}

vec3 displayed(vec3 linear) {
  if (directions) {
    return clamp(0.5 * linear + 0.5, 0.0, 1.0);
  }
  vec3 x = max(linear * exp2(exposure), 0.0);
  vec3 toned = view == 1 ? min(x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14), 1.0) : min(x, 1.0);
  toned = pow(toned, vec3(1.0 / gamma));
  return vec3(encoded(toned.r), encoded(toned.g), encoded(toned.b));
}

// A. Mikhailov's polynomial fit of Turbo (Google, 2019); t in [0, 1].
vec3 turbo(float t) {
  t = clamp(t, 0.0, 1.0);
  vec4 v4 = vec4(1.0, t, t * t, t * t * t);
  vec2 v2 = v4.zw * v4.z;
  return vec3(
    dot(v4, vec4(0.13572138, 4.61539260, -42.66032258, 132.13108234)) + dot(v2, vec2(-152.94239396, 59.28637943)),
    dot(v4, vec4(0.09140261, 2.19418839, 4.84296658, -14.18503333)) + dot(v2, vec2(4.27729857, 2.82956604)),
    dot(v4, vec4(0.10667330, 12.64194608, -60.58204836, 110.36276771)) + dot(v2, vec2(-89.90310912, 27.34824973)));
}

// The overlay at one pixel of the screen: the photons' hue, and their coverage. The square root makes a few photons visible.
vec4 photonsAt(vec2 at) {
  float width = 1.0 / zoom;
  int taps = clamp(int(ceil(width)), 1, kMaxTaps);
  vec3 sum = vec3(0.0);
  float covered = 0.0;
  for (int y = 0; y < taps; ++y) {
    for (int x = 0; x < taps; ++x) {
      vec2 offset = taps == 1 ? vec2(0.0) : ((vec2(x, y) + 0.5) / float(taps) - 0.5) * width;
      vec3 photon = texelFetch(photonMap, ivec2(clamp(at + offset, vec2(0.0), filmSize - 1.0)), 0).rgb;
      float strongest = max(photon.r, max(photon.g, photon.b));
      if (strongest > 0.0) {
        sum += photon / strongest;
        covered += 1.0;
      }
    }
  }
  return covered == 0.0 ? vec4(0.0) : vec4(sum / covered, sqrt(covered) / float(taps));
}

void main() {
  vec2 fromMiddle = vec2(gl_FragCoord.x - 0.5 * screenSize.x, 0.5 * screenSize.y - gl_FragCoord.y);
  vec2 at = center + fromMiddle / zoom;
  if (any(lessThan(at, vec2(0.0))) || any(greaterThanEqual(at, filmSize))) {
    shown = vec4(background, 1.0);
    return;
  }
  ivec2 pixel = ivec2(at);
  bool other = how == ${kComparisons.indexOf('other')} || (how == ${kComparisons.indexOf('split')} && gl_FragCoord.x >= splitAt);
  bool apart = how >= kDifference;
  float samples = apart ? min(samplesAt(false, pixel), samplesAt(true, pixel)) : samplesAt(other, pixel);
  if (samples == 0.0) {
    float checker = mod(floor(at.x / 8.0) + floor(at.y / 8.0), 2.0);
    shown = vec4(mix(background, vec3(0.5), 0.06 + 0.06 * checker), 1.0);
    return;
  }
  vec3 color = colorAt(other, at);
  float light = dot(color, kLuminance);
  vec3 result;
  if (how == kSquaredError) {
    result = turbo((log(max(dot(color, vec3(1.0 / 3.0)), 1e-9)) / log(10.0) + 6.0) / 6.0);
  } else if (how > kSquaredError) {
    result = turbo(color.r);
  } else if (how == kDifference || show == ${kShows.indexOf('color')}) {
    result = displayed(color);
  } else if (show == ${kShows.indexOf('red')}) {
    result = displayed(color.rrr);
  } else if (show == ${kShows.indexOf('green')}) {
    result = displayed(color.ggg);
  } else if (show == ${kShows.indexOf('blue')}) {
    result = displayed(color.bbb);
  } else if (show == ${kShows.indexOf('luminance')}) {
    result = displayed(vec3(light));
  } else if (show == ${kShows.indexOf('false-color')}) {
    result = turbo((log2(max(light, 1e-9)) + exposure + 8.0) / 12.0);
  } else if (show == ${kShows.indexOf('samples')}) {
    result = turbo(samples / max(mostSamples, 1.0));
  } else {
    float error = standardErrorAt(other, pixel);
    float value = show == ${kShows.indexOf('relative-error')} ? error / max(light, 1e-3) : error * exp2(exposure);
    result = error < 0.0 ? vec3(0.5) : turbo((log(max(value, 1e-9)) / log(10.0) + 4.0) / 4.0);
  }
  if (showPhotons && !apart && !other) {
    // The picture is darkened, so that photons are visible in bright places.
    vec4 over = photonsAt(at);
    result = mix(0.4 * result, vec3(encoded(over.r), encoded(over.g), encoded(over.b)), over.a);
  }
  shown = vec4(result, 1.0);
}`;
