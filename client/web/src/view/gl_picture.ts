/** Drawing of a film with WebGL2, from linear half floats. Tiles are uploaded as they come, and one shader does everything else. */
import type {Camera, Size} from '../model/camera';
import {kComparisons, type Comparison} from '../model/comparison';
import {kTileSide, type Film, type Rect} from '../model/film';
import {kShows, type DisplaySettings} from '../model/route';
import {kFragment, kVertex} from './gl_shader';

/** The values of a map's colours at its left end, middle and right end. */
export function legendOf(how: Comparison, display: DisplaySettings, mostSamples: number): [string, string, string] | undefined {
  const stops = (at: number) => (2 ** (at - display.exposure)).toPrecision(2);
  const tenths = (at: number) => (10 ** at / 2 ** display.exposure).toPrecision(2);
  if (how === 'squared-error') {
    return ['≤ 1e-6', '0.001', '≥ 1'];
  }
  if (how === 'flip' || how === 'hdr-flip') {
    return ['0', '0.5', '1'];
  }
  switch (how === 'difference' ? 'color' : display.show) {
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
  display: DisplaySettings;
  how: Comparison;
  /** The divider's position, as a fraction of the screen's width. */
  split: number;
  screen: Size;
  /** Device pixels per CSS pixel. */
  scale: number;
  /** sRGB in [0, 1]. */
  background: [number, number, number];
}

// Each film has two units: its pixels, then its counts.
const kFilmUnit = 0;
const kOtherUnit = 2;
const kMapUnit = 4;
const kPhotonUnit = 5;

function tileOriginOf(film: Film | undefined): [number, number] {
  return film ? [film.crop.x % kTileSide, film.crop.y % kTileSide] : [0, 0];
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
  private film: Film | undefined;
  private other: Film | undefined;
  private photonMap: Film | undefined;

  /** Throws without WebGL2. */
  constructor(private readonly canvas: HTMLCanvasElement) {
    // Kept after drawing, so that the screen can be copied.
    const gl = canvas.getContext('webgl2', {antialias: false, alpha: false, preserveDrawingBuffer: true});
    if (!gl) {
      throw new Error('this browser has no WebGL2, which the viewer needs');
    }
    this.gl = gl;
    this.program = gl.createProgram()!;
    gl.attachShader(this.program, compiled(gl, gl.VERTEX_SHADER, kVertex));
    gl.attachShader(this.program, compiled(gl, gl.FRAGMENT_SHADER, kFragment));
    gl.linkProgram(this.program);
    gl.bindVertexArray(gl.createVertexArray());
    [kFilmUnit, kFilmUnit + 1, kOtherUnit, kOtherUnit + 1, kMapUnit, kPhotonUnit, kPhotonUnit + 1].forEach((unit) => this.makeTexture(unit));
  }

  /** Sets the whole film, which another instance may have drawn. Throws if it is too large for the GPU. */
  setFilm(film: Film): void {
    this.upload(film, kFilmUnit);
    this.film = film;
  }

  /** Sets the film to compare with, of the same size; undefined: none. */
  setOther(film: Film | undefined): void {
    if (film) {
      this.upload(film, kOtherUnit);
    }
    this.other = film;
  }

  /** Sets the photon overlay, of the same size; undefined: none. */
  setPhotons(film: Film | undefined): void {
    if (film) {
      this.upload(film, kPhotonUnit);
    }
    this.photonMap = film;
  }

  /** Sets the difference of the two at each pixel, in [0, 1]. */
  setErrorMap(map: Float32Array): void {
    const gl = this.gl;
    const {width, height} = this.film?.crop ?? {width: 0, height: 0};
    if (map.length === width * height) {
      gl.activeTexture(gl.TEXTURE0 + kMapUnit);
      gl.texImage2D(gl.TEXTURE_2D, 0, gl.R32F, width, height, 0, gl.RED, gl.FLOAT, map);
    }
  }

  putTiles(film: Film, tiles: {rect: Rect; pixels: Uint16Array}[]): void {
    const gl = this.gl;
    const unit = film === this.film ? kFilmUnit : film === this.photonMap ? kPhotonUnit : kOtherUnit;
    gl.activeTexture(gl.TEXTURE0 + unit);
    for (const {rect, pixels} of tiles) {
      gl.texSubImage2D(gl.TEXTURE_2D, 0, rect.x, rect.y, rect.width, rect.height, gl.RGBA, gl.HALF_FLOAT, pixels);
    }
    this.setCounts(film, unit + 1);
  }

  draw({camera, display, how, split, screen, scale, background}: Drawing): void {
    const gl = this.gl;
    const width = Math.max(1, Math.round(screen.width * scale));
    const height = Math.max(1, Math.round(screen.height * scale));
    if (this.canvas.width !== width || this.canvas.height !== height) {
      this.canvas.width = width;
      this.canvas.height = height;
    }
    gl.viewport(0, 0, width, height);
    gl.useProgram(this.program);
    gl.uniform1i(this.place('film'), kFilmUnit);
    gl.uniform1i(this.place('counts'), kFilmUnit + 1);
    gl.uniform1i(this.place('otherFilm'), kOtherUnit);
    gl.uniform1i(this.place('otherCounts'), kOtherUnit + 1);
    gl.uniform1i(this.place('errorMap'), kMapUnit);
    gl.uniform1i(this.place('photonMap'), kPhotonUnit);
    gl.uniform1i(this.place('showPhotons'), this.photonMap ? 1 : 0);
    gl.uniform2f(this.place('filmSize'), this.film?.crop.width ?? 0, this.film?.crop.height ?? 0);
    gl.uniform2f(this.place('tileOrigin'), ...tileOriginOf(this.film));
    gl.uniform2f(this.place('otherOrigin'), ...tileOriginOf(this.other));
    gl.uniform2f(this.place('screenSize'), width, height);
    gl.uniform2f(this.place('center'), camera.center.x, camera.center.y);
    gl.uniform1f(this.place('zoom'), camera.zoom * scale);
    gl.uniform1f(this.place('exposure'), display.exposure);
    gl.uniform1f(this.place('gamma'), display.gamma);
    gl.uniform1i(this.place('view'), display.view === 'filmic' ? 1 : 0);
    gl.uniform1i(this.place('directions'), display.signed ? 1 : 0);
    gl.uniform1i(this.place('show'), kShows.indexOf(display.show));
    gl.uniform1i(this.place('how'), this.other ? kComparisons.indexOf(how) : 0);
    gl.uniform1f(this.place('splitAt'), split * width);
    gl.uniform1f(this.place('mostSamples'), this.film?.mostSamples() ?? 0);
    gl.uniform3f(this.place('background'), ...background);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
  }

  private upload(film: Film, unit: number): void {
    const gl = this.gl;
    const {width, height} = film.crop;
    const most = gl.getParameter(gl.MAX_TEXTURE_SIZE) as number;
    if (Math.max(width, height) > most) {
      throw new Error(`the picture is larger than ${most} pixels on a side, the limit of this browser`);
    }
    gl.activeTexture(gl.TEXTURE0 + unit);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA16F, width, height, 0, gl.RGBA, gl.HALF_FLOAT, film.rgbe);
    this.setCounts(film, unit + 1);
  }

  private setCounts(film: Film, unit: number): void {
    const gl = this.gl;
    gl.activeTexture(gl.TEXTURE0 + unit);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.R32F, film.columns, film.rows, 0, gl.RED, gl.FLOAT, film.counts);
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
