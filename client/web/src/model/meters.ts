/** The virtual meters of a job's scene: their places in the picture, and their readings. Pure. */
import type {RenderSettings} from '../wire/lightmill/v1/farm_pb';
import type {Camera, Meter, Meter_Patch, Scene} from '../wire/lightmill/v1/scene_pb';
import type {MeterReading} from '../wire/lightmill/v1/web_pb';
import type {Point} from './camera';
import {cross, dot, frameOf, length, minus, plus, times, type Vector} from './orbit';
import {fovOf, poseOf, vectorOf} from './scene_edit';

/** Projects a point of the scene to pixels of the crop; undefined behind the camera. */
export type Projection = (point: Vector) => Point | undefined;

/** Through the centre of the lens. */
export function projectionOf(camera: Camera | undefined, {width, height, crop}: Pick<RenderSettings, 'width' | 'height' | 'crop'>): Projection {
  const pose = poseOf(camera);
  const {right, above, forward} = frameOf(pose);
  const [x, y] = [width / 2 - height * (camera?.shiftX ?? 0), height / 2 + height * (camera?.shiftY ?? 0)];
  const pixels = height / (2 * Math.tan((fovOf(camera) * Math.PI) / 360));
  return (point) => {
    const offset = minus(point, pose.eye);
    const depth = dot(offset, forward);
    return depth > 1e-9 * length(offset)
      ? {
          x: x + (pixels * dot(offset, right)) / depth - (crop?.x ?? 0),
          y: y - (pixels * dot(offset, above)) / depth - (crop?.y ?? 0),
        }
      : undefined;
  };
}

/** The drawing of a meter. */
export interface MeterMark {
  name: string;
  /** The position of its name. */
  at: Point;
  /** The outline of its surface, closed; empty for points. */
  outline: Point[];
  /** For points: the end of the line that shows the direction. */
  tip: Point | undefined;
}

/** The length of direction lines, as a fraction of the distance from the camera. */
const kTip = 0.08;

function cornersOf(patch: Meter_Patch | undefined): Vector[] {
  const [corner, a, b] = [vectorOf(patch?.corner), vectorOf(patch?.edge1), vectorOf(patch?.edge2)];
  return [corner, plus(corner, a), plus(plus(corner, a), b), plus(corner, b)];
}

/** Undefined if any part lies behind the camera. */
function markOf(meter: Meter, scene: Scene, project: Projection): MeterMark | undefined {
  const {kind, name} = meter;
  if (kind.case === 'patch' || kind.case === 'flux') {
    const corners = cornersOf(kind.case === 'flux' ? kind.value.patch : kind.value);
    const outline = corners.map(project).filter((corner) => corner !== undefined);
    const middle = project(times(plus(corners[0]!, corners[2]!), 0.5));
    return middle && outline.length === corners.length ? {name, at: middle, outline, tip: undefined} : undefined;
  }
  if (kind.case !== 'irradiance' && kind.case !== 'radiance') {
    return undefined;
  }
  const point = vectorOf(kind.value.point);
  const way = vectorOf(kind.case === 'irradiance' ? kind.value.normal : kind.value.direction);
  const at = project(point);
  const reach = (kTip * length(minus(point, poseOf(scene.camera).eye))) / (length(way) || 1);
  return at && {name, at, outline: [], tip: project(plus(point, times(way, reach)))};
}

/** The marks of the meters in front of the camera, by index in the scene. */
export function marksOf(scene: Scene, settings: Pick<RenderSettings, 'width' | 'height' | 'crop'>): Map<number, MeterMark> {
  const project = projectionOf(scene.camera, settings);
  const marks = new Map<number, MeterMark>();
  scene.meters.forEach((meter, i) => {
    const mark = markOf(meter, scene, project);
    if (mark) {
      marks.set(i, mark);
    }
  });
  return marks;
}

const kLetter = 6.5;
const kLine = 15;

/** Vertical positions of text lines at these points of the screen. A line that would overlap another moves up. */
export function labelPlaces(labels: readonly {at: Point; text: string}[]): Point[] {
  const places: Point[] = [];
  labels.forEach(({at}, i) => {
    const place = {...at};
    const meets = (other: Point, j: number) =>
      Math.abs(other.y - place.y) < kLine && place.x < other.x + kLetter * labels[j]!.text.length && other.x < place.x + kLetter * labels[i]!.text.length;
    for (let turns = 0; turns < labels.length && places.some(meets); ++turns) {
      place.y = Math.min(...places.filter(meets).map(({y}) => y)) - kLine;
    }
    places.push(place);
  });
  return places;
}

/** The factor of a reading: a flux meter's patch, else 1. */
function areaOf(meter: Meter): number {
  const patch = meter.kind.case === 'flux' ? meter.kind.value.patch : undefined;
  return patch ? length(cross(vectorOf(patch.edge1), vectorOf(patch.edge2))) : 1;
}

const kUnits = {
  irradiance: ['W/m²', 'lx'],
  patch: ['W/m²', 'lx'],
  radiance: ['W/(m² sr)', 'cd/m²'],
  flux: ['W', 'lm'],
} as const;

/** As in the command line: an exponent with at least two digits. */
function exponential(value: number, digits: number): string {
  return value.toExponential(digits).replace(/e([+-])(\d)$/, 'e$10$2');
}

/** A value up to the second digit of its error, but at most seven digits. */
export function withError(value: number, halfWidth: number): string {
  if (!(halfWidth > 1e-7 * Math.abs(value))) {
    return `${Number(value.toPrecision(7))} ± ${Number(halfWidth.toPrecision(2))}`;
  }
  const place = Math.floor(Math.log10(halfWidth)) - 1;
  const largest = Math.max(Math.abs(value), halfWidth);
  if (largest >= 1e-4 && largest < 1e6) {
    const decimals = Math.max(-place, 0);
    return `${value.toFixed(decimals)} ± ${halfWidth.toFixed(decimals)}`;
  }
  const first = Math.floor(Math.log10(Math.max(Math.abs(value), halfWidth / 10)));
  return `${exponential(value, Math.min(Math.max(first - place, 0), 20))} ± ${exponential(halfWidth, 1)}`;
}

/** "12.3 ± 0.4 W/m²" and the same in photometric units; empty while nothing is known. */
export function readingTexts(meter: Meter, reading: MeterReading): [string, string] {
  const kind = meter.kind.case;
  if (reading.samples === 0n || kind === undefined) {
    return ['', ''];
  }
  const area = areaOf(meter);
  const [radiometric, photometric] = kUnits[kind];
  return [
    `${withError(area * reading.value, area * reading.halfWidth)} ${radiometric}`,
    `${withError(area * reading.photometric, area * reading.photometricHalfWidth)} ${photometric}`,
  ];
}
