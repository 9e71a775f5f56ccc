/** The page's route: the part of its address after '#'. Every view has a link. */
import type {Camera} from './camera';
import {kComparisons, type Against} from './comparison';
import type {Rect} from './film';
import {parseRelight, relightText, type Relight} from './layers';
import type {Tone} from './tone';

export const kShows = ['color', 'red', 'green', 'blue', 'luminance', 'false-color', 'error', 'relative-error', 'samples'] as const;
/** The display of the picture. */
export type Show = (typeof kShows)[number];

export interface DisplaySettings extends Tone {
  show: Show;
}
export const kPlainDisplay: DisplaySettings = {exposure: 0, gamma: 1, view: 'plain', show: 'color'};
export const kMaxStops = 20;
export const kMaxGamma = 10;

/** The photon overlay. `caustic`: only photons that met mirrors or glass first. */
export const kPhotons = ['none', 'few', 'many', 'caustic'] as const;
export type Photons = (typeof kPhotons)[number];

/** The view of one job's page. */
export interface JobView {
  display: DisplaySettings;
  /** Undefined: the whole picture. */
  camera: Camera | undefined;
  against: Against | undefined;
  /** The measured region, in pixels of the crop. */
  region: Rect | undefined;
  /** Other jobs in the chart. */
  charted: readonly bigint[];
  /** Empty: beauty. Undefined: the page chooses. */
  layer: string | undefined;
  /** The mix of the light groups. */
  relight: Relight;
  photons: Photons;
  /** Whether the scene's meters are drawn over the picture. */
  meters: boolean;
}

export type Route = {page: 'jobs'} | {page: 'workers'} | {page: 'lab'} | {page: 'nowhere'; path: string} | ({page: 'job'; job: bigint} & JobView);

const kBeauty = 'beauty';

/** Limit of other jobs in one chart. */
export const kMaxCharted = 7;

function number(text: string | null, least: number, most: number, otherwise: number): number {
  const value = text === null || text === '' ? NaN : Number(text);
  return Number.isFinite(value) ? Math.min(Math.max(value, least), most) : otherwise;
}

function cameraOf(parameters: URLSearchParams): Camera | undefined {
  const zoom = number(parameters.get('zoom'), 1 / 64, 64, NaN);
  const center = {
    x: number(parameters.get('x'), 0, 65536, NaN),
    y: number(parameters.get('y'), 0, 65536, NaN),
  };
  return Number.isNaN(zoom + center.x + center.y) ? undefined : {zoom, center};
}

function jobNumber(text: string | null): bigint | undefined {
  return text !== null && /^\d{1,19}$/.test(text) ? BigInt(text) : undefined;
}

function againstOf(parameters: URLSearchParams): Against | undefined {
  const other = parameters.get('with') === 'file' ? 'file' : jobNumber(parameters.get('with'));
  const how = kComparisons.find((each) => each === parameters.get('how')) ?? 'split';
  return other === undefined ? undefined : {other, how, split: number(parameters.get('split'), 0, 1, 0.5)};
}

function regionOf(parameters: URLSearchParams): Rect | undefined {
  const [x, y, width, height] = (parameters.get('region') ?? '').split(',').map((text) => (/^\d{1,5}$/.test(text) ? Number(text) : 0));
  return width && height ? {x: x!, y: y!, width, height} : undefined;
}

function layerOf(parameters: URLSearchParams): string | undefined {
  const layer = /^[\w:-]{1,80}$/.exec(parameters.get('layer') ?? '')?.[0];
  return layer === kBeauty ? '' : layer;
}

function chartedOf(parameters: URLSearchParams): bigint[] {
  const jobs = (parameters.get('chart') ?? '').split(',').map(jobNumber);
  return [...new Set(jobs)].filter((job) => job !== undefined).slice(0, kMaxCharted);
}

/** Accepts any address. Invalid parts are ignored. */
export function parseRoute(hash: string): Route {
  const [path = '', query = ''] = hash.replace(/^#/, '').split('?', 2);
  const job = /^\/jobs\/(\d{1,19})$/.exec(path);
  if (job) {
    const parameters = new URLSearchParams(query);
    const show = kShows.find((each) => each === parameters.get('show')) ?? kPlainDisplay.show;
    const display: DisplaySettings = {
      exposure: number(parameters.get('exposure'), -kMaxStops, kMaxStops, 0),
      gamma: number(parameters.get('gamma'), 0.1, kMaxGamma, 1),
      view: parameters.get('view') === 'filmic' ? 'filmic' : 'plain',
      show,
    };
    return {
      page: 'job',
      job: BigInt(job[1]!),
      display,
      camera: cameraOf(parameters),
      against: againstOf(parameters),
      region: regionOf(parameters),
      charted: chartedOf(parameters),
      layer: layerOf(parameters),
      relight: parseRelight(parameters.get('relight') ?? ''),
      photons: kPhotons.find((each) => each === parameters.get('photons')) ?? 'none',
      meters: parameters.get('meters') !== 'off',
    };
  }
  switch (path) {
    case '':
    case '/':
    case '/jobs':
      return {page: 'jobs'};
    case '/workers':
      return {page: 'workers'};
    case '/lab':
      return {page: 'lab'};
    default:
      return {page: 'nowhere', path};
  }
}

/** The inverse. Defaults are left out. */
export function routeHash(route: Route): string {
  if (route.page === 'nowhere') {
    return `#${route.path}`;
  }
  if (route.page !== 'job') {
    return `#/${route.page}`;
  }
  const parameters = new URLSearchParams();
  const {display, camera, against, region, charted, layer, relight, photons, meters} = route;
  if (display.exposure !== 0) {
    parameters.set('exposure', String(display.exposure));
  }
  if (display.gamma !== 1) {
    parameters.set('gamma', String(display.gamma));
  }
  if (display.view !== 'plain') {
    parameters.set('view', display.view);
  }
  if (display.show !== 'color') {
    parameters.set('show', display.show);
  }
  if (camera) {
    parameters.set('zoom', String(Number(camera.zoom.toPrecision(9))));
    parameters.set('x', String(Number(camera.center.x.toFixed(6))));
    parameters.set('y', String(Number(camera.center.y.toFixed(6))));
  }
  if (against) {
    parameters.set('with', String(against.other));
    parameters.set('how', against.how);
    if (against.split !== 0.5) {
      parameters.set('split', String(Number(against.split.toFixed(4))));
    }
  }
  if (region) {
    parameters.set('region', [region.x, region.y, region.width, region.height].join(','));
  }
  if (charted.length > 0) {
    parameters.set('chart', charted.join(','));
  }
  if (layer !== undefined) {
    parameters.set('layer', layer || kBeauty);
  }
  if (relight.size > 0) {
    parameters.set('relight', relightText(relight));
  }
  if (photons !== 'none') {
    parameters.set('photons', photons);
  }
  if (!meters) {
    parameters.set('meters', 'off');
  }
  const query = parameters.toString().replaceAll('%2C', ',').replaceAll('%3A', ':').replaceAll('%7E', '~');
  return `#/jobs/${route.job}${query ? `?${query}` : ''}`;
}
