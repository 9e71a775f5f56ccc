/** A film's layers as the page shows them, and the mix of light groups. Pure. */
import {ofSwatch, swatchOf} from './color';
import {kTileSide, type Film, type Rect} from './film';
import {kHalfValues, toHalf} from './half';
import type {Rgb} from './tone';
import type {Show} from './route';
import type {LayerFailure} from '../wire/lightmill/v1/web_pb';

/** The denoised picture, which the coordinator makes of the layer `features`. */
export const kDenoised = 'denoised';
const kFeatures = 'features';

const kLabels = new Map([
  [kDenoised, 'Denoised'],
  ['direct', 'Direct light'],
  ['indirect', 'Indirect light'],
  ['caustic', 'Caustics'],
  ['bias', 'Photon bias'],
  ['albedo', 'Albedo'],
  ['normal', 'Normals'],
  ['depth', 'Depth'],
]);
const kLight = 'light:';
export const kRest = 'light:rest';

/** The pictures that the page can show of a film with these layers, besides beauty. */
export function shownLayers(layers: readonly string[]): string[] {
  const pictures = layers.filter((layer) => layer !== 'id' && layer !== kFeatures);
  return layers.includes(kFeatures) ? [kDenoised, ...pictures] : pictures;
}

/** The layer that is shown unless the user chooses one; beauty is ''. Errors, counts, comparisons and mixes are of the raw picture. */
export function defaultLayer(shown: readonly string[], show: Show, relight: Relight, comparing: boolean): string {
  const plain = show !== 'error' && show !== 'relative-error' && show !== 'samples';
  return shown.includes(kDenoised) && relight.size === 0 && plain && !comparing ? kDenoised : '';
}

/** The light layers, which add up to all of the light. Empty if the job has no light groups. */
export function lightLayers(layers: readonly string[]): string[] {
  return layers.filter((layer) => layer.startsWith(kLight));
}

export function layerLabel(layer: string): string {
  return layer === '' ? 'Beauty' : layer === kRest ? 'All other light' : layer.startsWith(kLight) ? `Light: ${layer.slice(kLight.length)}` : (kLabels.get(layer) ?? layer);
}

/** The reason why a layer's pixels are not sent, by layer; beauty is ''. */
export type LayerFailures = ReadonlyMap<string, string>;
export const kNoFailures: LayerFailures = new Map();

export function withLayerFailures(failures: LayerFailures, news: readonly LayerFailure[]): LayerFailures {
  if (news.length === 0) {
    return failures;
  }
  const next = new Map(failures);
  for (const {layer, why} of news) {
    if (why) {
      next.set(layer, why);
    } else {
      next.delete(layer);
    }
  }
  return next;
}

/** A sentence about the requested layers without pixels; empty if all are sent. */
export function failureOf(failures: LayerFailures, wanted: readonly string[]): string {
  const failed = wanted.filter((layer) => failures.has(layer));
  return failed.length > 0 ? `${failed.map(layerLabel).join(', ')} cannot be shown: ${failures.get(failed[0]!)}` : '';
}

/** The name of a light's layer. */
export function groupName(layer: string): string {
  return layer === kRest ? 'all other light' : layer.slice(kLight.length);
}

/** The setting of one light group: its light times 2^stops, tinted. Undefined stops: switched off. */
export interface Gain {
  stops: number | undefined;
  /** Each in [0, 1]. */
  tint: Rgb;
}
export const kMaxGainStops = 8;
export const kAsRendered: Gain = {stops: 0, tint: [1, 1, 1]};

/** By layer. Layers that are not in it stay as rendered. */
export type Relight = ReadonlyMap<string, Gain>;

export function isAsRendered({stops, tint}: Gain): boolean {
  return stops === 0 && tint.every((value) => value === 1);
}

export function withGain(relight: Relight, layer: string, gain: Gain): Relight {
  const next = new Map(relight);
  if (isAsRendered(gain)) {
    next.delete(layer);
  } else {
    next.set(layer, gain);
  }
  return next;
}

/** The factors of the layer's values. */
export function factorOf(gain: Gain | undefined): Rgb {
  const {stops, tint} = gain ?? kAsRendered;
  return stops === undefined ? [0, 0, 0] : (tint.map((value) => value * 2 ** stops) as Rgb);
}

// ---- in links: "key:1.5~ff8000,fill:off" ----

export function relightText(relight: Relight): string {
  const parts = [...relight].map(([layer, {stops, tint}]) => `${layer.slice(kLight.length)}:${stops === undefined ? 'off' : stops}${tint.every((value) => value === 1) ? '' : `~${swatchOf(tint).slice(1)}`}`);
  return parts.join(',');
}

/** Ignores what it does not understand. */
export function parseRelight(text: string): Relight {
  const relight = new Map<string, Gain>();
  for (const part of text.split(',')) {
    const match = /^([\w-]{1,64}):(off|-?\d+(?:\.\d+)?)(?:~([0-9a-f]{6}))?$/.exec(part);
    if (match) {
      const [, name, stops, tint] = match;
      const number = Math.min(Math.max(Number(stops), -kMaxGainStops), kMaxGainStops);
      relight.set(kLight + name!, {stops: stops === 'off' ? undefined : number, tint: tint ? ofSwatch(`#${tint}`) : kAsRendered.tint});
    }
  }
  return new Map([...relight].filter(([, gain]) => !isAsRendered(gain)));
}

// ---- pixels ----

const kUnknown = 0xbc00;

/**
 * Fills a rectangle of `target`, in pixels of its crop, with the weighted sum of the layers. The errors of the sum are unknown, because
 * layers are correlated.
 */
export function mix(target: Film, layers: readonly {film: Film; factor: Rgb}[], rect: Rect): void {
  const {width} = target.crop;
  const lit = layers.filter(({factor}) => factor.some((value) => value !== 0));
  for (let y = rect.y; y < rect.y + rect.height; ++y) {
    for (let at = 4 * (y * width + rect.x), end = at + 4 * rect.width; at < end; at += 4) {
      let [r, g, b] = [0, 0, 0];
      for (const {film, factor} of lit) {
        r += kHalfValues[film.rgbe[at]!]! * factor[0];
        g += kHalfValues[film.rgbe[at + 1]!]! * factor[1];
        b += kHalfValues[film.rgbe[at + 2]!]! * factor[2];
      }
      target.rgbe[at] = toHalf(r);
      target.rgbe[at + 1] = toHalf(g);
      target.rgbe[at + 2] = toHalf(b);
      target.rgbe[at + 3] = kUnknown;
    }
  }
  const tile = (x: number, y: number) => Math.min(...layers.map(({film}) => film.samplesAt(x, y)));
  for (let y = rect.y; y < rect.y + rect.height; y = nextTile(target.crop.y, y)) {
    for (let x = rect.x; x < rect.x + rect.width; x = nextTile(target.crop.x, x)) {
      target.setSamplesAt(x, y, layers.length > 0 ? tile(x, y) : 0);
    }
  }
}

/** The first pixel after the tile of pixel `at`. Both are in the crop, which begins at `origin`. */
function nextTile(origin: number, at: number): number {
  return (Math.floor((origin + at) / kTileSide) + 1) * kTileSide - origin;
}
