/** Where the page is, as the part of its address behind '#': every view has a link that brings it back. */
import type {Camera} from './camera';
import type {Tone} from './tone';

export const kShows = ['color', 'red', 'green', 'blue', 'luminance', 'false-color', 'error', 'relative-error', 'samples'] as const;
/** What the picture shows. */
export type Show = (typeof kShows)[number];

export interface Look extends Tone {
  show: Show;
}
export const kPlainLook: Look = {exposure: 0, gamma: 1, view: 'plain', show: 'color'};
export const kMostStops = 20;
export const kMostGamma = 10;

export type Route =
  | {page: 'jobs'}
  | {page: 'workers'}
  | {page: 'job'; job: bigint; look: Look; camera: Camera | undefined};

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

/** Whatever the address says; what it says wrongly is as if it said nothing. */
export function parseRoute(hash: string): Route {
  const [path = '', query = ''] = hash.replace(/^#/, '').split('?', 2);
  const job = /^\/jobs\/(\d{1,19})$/.exec(path);
  if (job) {
    const parameters = new URLSearchParams(query);
    const show = kShows.find((each) => each === parameters.get('show')) ?? kPlainLook.show;
    const look: Look = {
      exposure: number(parameters.get('exposure'), -kMostStops, kMostStops, 0),
      gamma: number(parameters.get('gamma'), 0.1, kMostGamma, 1),
      view: parameters.get('view') === 'filmic' ? 'filmic' : 'plain',
      show,
    };
    return {page: 'job', job: BigInt(job[1]!), look, camera: cameraOf(parameters)};
  }
  return {page: path === '/workers' ? 'workers' : 'jobs'};
}

/** The inverse; what is as usual is left out. */
export function routeHash(route: Route): string {
  if (route.page !== 'job') {
    return route.page === 'workers' ? '#/workers' : '#/jobs';
  }
  const parameters = new URLSearchParams();
  const {look, camera} = route;
  if (look.exposure !== 0) {
    parameters.set('exposure', String(look.exposure));
  }
  if (look.gamma !== 1) {
    parameters.set('gamma', String(look.gamma));
  }
  if (look.view !== 'plain') {
    parameters.set('view', look.view);
  }
  if (look.show !== 'color') {
    parameters.set('show', look.show);
  }
  if (camera) {
    parameters.set('zoom', String(Number(camera.zoom.toPrecision(9))));
    parameters.set('x', String(Number(camera.center.x.toFixed(6))));
    parameters.set('y', String(Number(camera.center.y.toFixed(6))));
  }
  const query = parameters.toString();
  return `#/jobs/${route.job}${query ? `?${query}` : ''}`;
}
