/** Draws a film with WebGL2 from linear half floats: tiles are uploaded as they come, everything else is done by one shader. */
import type {Camera, Size} from '../model/camera';
import {kSmoothing, type Film, type Rect} from '../model/film';
import {kShows, type Look, type Show} from '../model/route';

const kVertex = `#version 300 es
void main() {
  vec2 corner = vec2(gl_VertexID & 1, gl_VertexID >> 1) * 4.0 - 1.0;
  gl_Position = vec4(corner, 0.0, 1.0);
}`;

const kFragment = `#version 300 es
precision highp float;
precision highp sampler2D;
uniform sampler2D film;      // R, G, B and the standard error of the luminance; -1 where that is not known
uniform sampler2D counts;    // samples per pixel, by tile
uniform vec2 filmSize;       // pixels
uniform vec2 tileOrigin;     // of the first pixel within its tile
uniform vec2 screenSize;     // device pixels
uniform vec2 center;         // the film's point in the middle
uniform float zoom;          // device pixels per pixel of the film
uniform float exposure, gamma;
uniform int view, show;
uniform float mostSamples;
uniform vec3 background;
out vec4 shown;

const vec3 kLuminance = vec3(0.2126, 0.7152, 0.0722);
const int kMostTaps = 8;

float samplesAt(ivec2 pixel) {
  return texelFetch(counts, (pixel + ivec2(tileOrigin)) / 64, 0).r;
}

// The mean of the film's pixels below one pixel of the screen.
vec3 colorAt(vec2 at) {
  float width = 1.0 / zoom;
  if (width <= 1.0) {
    return texelFetch(film, ivec2(at), 0).rgb;
  }
  int taps = min(int(ceil(width)), kMostTaps);
  vec3 sum = vec3(0.0);
  for (int y = 0; y < taps; ++y) {
    for (int x = 0; x < taps; ++x) {
      vec2 offset = (vec2(x, y) + 0.5) / float(taps) - 0.5;
      sum += texelFetch(film, ivec2(clamp(at + offset * width, vec2(0.0), filmSize - 1.0)), 0).rgb;
    }
  }
  return sum / float(taps * taps);
}

float standardErrorAt(ivec2 pixel) {
  float sum = 0.0, known = 0.0;
  for (int y = -${kSmoothing}; y <= ${kSmoothing}; ++y) {
    for (int x = -${kSmoothing}; x <= ${kSmoothing}; ++x) {
      ivec2 at = pixel + ivec2(x, y);
      if (any(lessThan(at, ivec2(0))) || any(greaterThanEqual(at, ivec2(filmSize)))) {
        continue;
      }
      float error = texelFetch(film, at, 0).a;
      if (error >= 0.0 && samplesAt(at) > 0.0) {
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

void main() {
  vec2 fromMiddle = vec2(gl_FragCoord.x - 0.5 * screenSize.x, 0.5 * screenSize.y - gl_FragCoord.y);
  vec2 at = center + fromMiddle / zoom;
  if (any(lessThan(at, vec2(0.0))) || any(greaterThanEqual(at, filmSize))) {
    shown = vec4(background, 1.0);
    return;
  }
  ivec2 pixel = ivec2(at);
  float samples = samplesAt(pixel);
  if (samples == 0.0) {
    float checker = mod(floor(at.x / 8.0) + floor(at.y / 8.0), 2.0);
    shown = vec4(mix(background, vec3(0.5), 0.06 + 0.06 * checker), 1.0);
    return;
  }
  vec3 color = colorAt(at);
  float light = dot(color, kLuminance);
  vec3 result;
  if (show == ${kShows.indexOf('color')}) {
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
    float error = standardErrorAt(pixel);
    float value = show == ${kShows.indexOf('relative-error')} ? error / max(light, 1e-3) : error * exp2(exposure);
    result = error < 0.0 ? vec3(0.5) : turbo((log(max(value, 1e-9)) / log(10.0) + 4.0) / 4.0);
  }
  shown = vec4(result, 1.0);
}`;

/** What the colours of a map stand for: its left end, its middle and its right end. */
export function legendOf(show: Show, look: Look, mostSamples: number): [string, string, string] | undefined {
  const stops = (at: number) => (2 ** (at - look.exposure)).toPrecision(2);
  const tenths = (at: number) => (10 ** at / 2 ** look.exposure).toPrecision(2);
  switch (show) {
    case 'false-color':
      return [`≤ ${stops(-8)}`, stops(-2), `≥ ${stops(4)}`];
    case 'error':
      return [`≤ ${tenths(-4)}`, tenths(-2), `≥ ${tenths(0)}`];
    case 'relative-error':
      return ['≤ 0.01%', '1%', '≥ 100%'];
    case 'samples':
      return ['0', String(Math.round(mostSamples / 2)), String(mostSamples)];
    default:
      return undefined;
  }
}

export interface Drawing {
  camera: Camera;
  look: Look;
  screen: Size;
  /** Device pixels per CSS pixel. */
  scale: number;
  /** sRGB in [0, 1]. */
  background: [number, number, number];
}

function compiled(gl: WebGL2RenderingContext, type: number, source: string): WebGLShader {
  const shader = gl.createShader(type)!;
  gl.shaderSource(shader, source);
  gl.compileShader(shader);
  if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) {
    throw new Error(`the shader does not compile: ${gl.getShaderInfoLog(shader)}`);
  }
  return shader;
}

export class GlPicture {
  private readonly gl: WebGL2RenderingContext;
  private readonly program: WebGLProgram;
  private readonly places = new Map<string, WebGLUniformLocation | null>();
  private size: Size = {width: 0, height: 0};
  private tileOrigin = {x: 0, y: 0};
  private mostSamples = 0;

  /** Throws where there is no WebGL2. */
  constructor(private readonly canvas: HTMLCanvasElement) {
    // Kept after drawing, so that what is on the screen can be copied.
    const gl = canvas.getContext('webgl2', {antialias: false, alpha: false, preserveDrawingBuffer: true});
    if (!gl) {
      throw new Error('this browser has no WebGL2, which the picture is drawn with');
    }
    this.gl = gl;
    this.program = gl.createProgram()!;
    gl.attachShader(this.program, compiled(gl, gl.VERTEX_SHADER, kVertex));
    gl.attachShader(this.program, compiled(gl, gl.FRAGMENT_SHADER, kFragment));
    gl.linkProgram(this.program);
    gl.bindVertexArray(gl.createVertexArray());
    this.makeTexture(0);
    this.makeTexture(1);
  }

  /** Takes the whole film, which may have been drawn before by another. Throws if it is too large for this machine. */
  setFilm(film: Film): void {
    const gl = this.gl;
    const most = gl.getParameter(gl.MAX_TEXTURE_SIZE) as number;
    if (Math.max(film.crop.width, film.crop.height) > most) {
      throw new Error(`the picture is larger than the ${most} pixels that this machine's graphics can draw`);
    }
    this.size = {width: film.crop.width, height: film.crop.height};
    this.tileOrigin = {x: film.crop.x % 64, y: film.crop.y % 64};
    gl.activeTexture(gl.TEXTURE0);
    const {width, height} = this.size;
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA16F, width, height, 0, gl.RGBA, gl.HALF_FLOAT, film.rgbe);
    this.setCounts(film);
  }

  putTiles(film: Film, tiles: {rect: Rect; pixels: Uint16Array}[]): void {
    const gl = this.gl;
    gl.activeTexture(gl.TEXTURE0);
    for (const {rect, pixels} of tiles) {
      gl.texSubImage2D(gl.TEXTURE_2D, 0, rect.x, rect.y, rect.width, rect.height, gl.RGBA, gl.HALF_FLOAT, pixels);
    }
    this.setCounts(film);
  }

  draw({camera, look, screen, scale, background}: Drawing): void {
    const gl = this.gl;
    const width = Math.max(1, Math.round(screen.width * scale));
    const height = Math.max(1, Math.round(screen.height * scale));
    if (this.canvas.width !== width || this.canvas.height !== height) {
      this.canvas.width = width;
      this.canvas.height = height;
    }
    gl.viewport(0, 0, width, height);
    gl.useProgram(this.program);
    gl.uniform1i(this.place('film'), 0);
    gl.uniform1i(this.place('counts'), 1);
    gl.uniform2f(this.place('filmSize'), this.size.width, this.size.height);
    gl.uniform2f(this.place('tileOrigin'), this.tileOrigin.x, this.tileOrigin.y);
    gl.uniform2f(this.place('screenSize'), width, height);
    gl.uniform2f(this.place('center'), camera.center.x, camera.center.y);
    gl.uniform1f(this.place('zoom'), camera.zoom * scale);
    gl.uniform1f(this.place('exposure'), look.exposure);
    gl.uniform1f(this.place('gamma'), look.gamma);
    gl.uniform1i(this.place('view'), look.view === 'filmic' ? 1 : 0);
    gl.uniform1i(this.place('show'), kShows.indexOf(look.show));
    gl.uniform1f(this.place('mostSamples'), this.mostSamples);
    gl.uniform3f(this.place('background'), ...background);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
  }

  private setCounts(film: Film): void {
    const gl = this.gl;
    gl.activeTexture(gl.TEXTURE1);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.R32F, film.columns, film.rows, 0, gl.RED, gl.FLOAT, film.counts);
    this.mostSamples = film.mostSamples();
  }

  private makeTexture(unit: number): void {
    const gl = this.gl;
    gl.activeTexture(gl.TEXTURE0 + unit);
    gl.bindTexture(gl.TEXTURE_2D, gl.createTexture());
    for (const name of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) {
      gl.texParameteri(gl.TEXTURE_2D, name, gl.NEAREST);
    }
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_T, gl.CLAMP_TO_EDGE);
  }

  private place(name: string): WebGLUniformLocation | null {
    if (!this.places.has(name)) {
      this.places.set(name, this.gl.getUniformLocation(this.program, name));
    }
    return this.places.get(name)!;
  }
}
