/** Key bindings of the picture. */
import type {Camera, Point} from '../model/camera';
import type {Against, Comparison} from '../model/comparison';
import type {Rect} from '../model/film';
import {kMaxStops, kPlainDisplay, type DisplaySettings} from '../model/route';
import type {Steering} from './viewer';

export interface KeyTargets {
  display: DisplaySettings;
  camera: Camera;
  against: Against | undefined;
  drawing: boolean;
  onDisplay: (display: DisplaySettings) => void;
  onCamera: (camera: Camera | undefined) => void;
  onAgainst: (against: Against) => void;
  onDrawing: (drawing: boolean) => void;
  onRegion: (region: Rect | undefined) => void;
  onNormalize: () => void;
  /** Moves the picture by CSS pixels. */
  move: (by: Point) => void;
  /** Around the middle of the screen. */
  zoom: (factor: number) => void;
  /** Moves or grows the region by pixels of the picture. Makes one if there is none. */
  changeRegion: (by: Partial<Rect>) => void;
}

const kPanPixels = 40;
const kKeyZoom = 1.25;
const kSplitStep = 0.05;
/** Step of a key that moves a region, in pixels of the screen. At least one pixel of the picture. */
const kRegionPixels = 8;

function comparisonKeys({against, onAgainst}: KeyTargets): Record<string, () => void> {
  if (!against) {
    return {};
  }
  const show = (how: Comparison) => () => onAgainst({...against, how});
  const slide = (by: number) => () => onAgainst({...against, how: 'split', split: Math.min(Math.max(against.split + by, 0), 1)});
  return {
    b: show(against.how === 'other' ? 'picture' : 'other'),
    s: show('split'),
    d: show('difference'),
    q: show('squared-error'),
    p: show('flip'),
    '[': slide(-kSplitStep),
    ']': slide(kSplitStep),
  };
}

function arrowKeys(targets: KeyTargets, shift: boolean): Record<string, () => void> {
  const {drawing, camera} = targets;
  const step = Math.max(1, Math.round(kRegionPixels / camera.zoom));
  const go = (x: number, y: number) => () => {
    if (!drawing) {
      targets.move({x: -x * kPanPixels, y: -y * kPanPixels});
    } else {
      targets.changeRegion(shift ? {width: x * step, height: y * step} : {x: x * step, y: y * step});
    }
  };
  return {arrowleft: go(-1, 0), arrowright: go(1, 0), arrowup: go(0, -1), arrowdown: go(0, 1)};
}

/** As a fraction of the picture's height. */
const kSteerStep = 0.03;
const kDollyStep = 1.1;

/** Key bindings while the scene's camera is moved. Arrows move the camera, not the scene. */
export function steeringKeys(steering: Steering, shift: boolean): Record<string, () => void> {
  const go = (x: number, y: number) => () => (shift ? steering.pan : steering.orbit)(-x * kSteerStep, -y * kSteerStep);
  const dolly = (factor: number) => () => steering.dolly(factor);
  const nothing = () => undefined;
  return {
    arrowleft: go(-1, 0),
    arrowright: go(1, 0),
    arrowup: go(0, -1),
    arrowdown: go(0, 1),
    '+': dolly(1 / kDollyStep),
    '=': dolly(1 / kDollyStep),
    '-': dolly(kDollyStep),
    m: nothing,
    '1': nothing,
  };
}

/** By the key's name in lower case. */
export function viewerKeys(targets: KeyTargets, shift: boolean): Record<string, () => void> {
  const {display, camera, onDisplay, onCamera, drawing} = targets;
  const brighter = (stops: number) => onDisplay({...display, exposure: Math.min(Math.max(display.exposure + stops, -kMaxStops), kMaxStops)});
  const remove = () => {
    targets.onRegion(undefined);
    targets.onDrawing(false);
  };
  const measure = () => {
    targets.onDrawing(!drawing);
    if (!drawing) {
      targets.changeRegion({});
    }
  };
  return {
    ...arrowKeys(targets, shift),
    ...comparisonKeys(targets),
    '+': () => targets.zoom(kKeyZoom),
    '=': () => targets.zoom(kKeyZoom),
    '-': () => targets.zoom(1 / kKeyZoom),
    f: () => onCamera(undefined),
    '1': () => onCamera({zoom: 1, center: camera.center}),
    e: () => brighter(shift ? -0.5 : 0.5),
    n: targets.onNormalize,
    v: () => onDisplay({...display, view: display.view === 'plain' ? 'filmic' : 'plain'}),
    r: () => onDisplay(kPlainDisplay),
    m: measure,
    escape: remove,
    delete: remove,
  };
}
