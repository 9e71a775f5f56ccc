/** Motions of a scene's camera: orbit, pan and dolly. Pure. Lengths are in scene units. */

export type Vector = readonly [number, number, number];

export interface Pose {
  eye: Vector;
  /** The centre of the orbit. */
  lookAt: Vector;
  /** Need not be a unit vector. */
  up: Vector;
}

/** Least angle between the view and straight up or down, radians. There left and right would swap. */
const kMinPolar = Math.PI / 180;
/** Limits of the distance: the camera never reaches its target, and stays within the limits of scene documents. */
const kMinDistance = 1e-9;
const kMaxDistance = 1e11;

export const plus = (a: Vector, b: Vector): Vector => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
export const minus = (a: Vector, b: Vector): Vector => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
export const times = (a: Vector, factor: number): Vector => [a[0] * factor, a[1] * factor, a[2] * factor];
export const dot = (a: Vector, b: Vector): number => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const length = (a: Vector): number => Math.hypot(...a);
export const cross = (a: Vector, b: Vector): Vector => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];

function unit(a: Vector, otherwise: Vector): Vector {
  const size = length(a);
  return size > 0 ? times(a, 1 / size) : otherwise;
}

/** Rotates counter-clockwise seen against the unit vector `axis`, by Rodrigues' formula. */
export function rotated(a: Vector, axis: Vector, radians: number): Vector {
  const [sin, cos] = [Math.sin(radians), Math.cos(radians)];
  return plus(plus(times(a, cos), times(cross(axis, a), sin)), times(axis, dot(axis, a) * (1 - cos)));
}

/** Unit vectors to the right, upwards, and into the picture. */
export function frameOf({eye, lookAt, up}: Pose): {right: Vector; above: Vector; forward: Vector} {
  const forward = unit(minus(lookAt, eye), [0, 0, -1]);
  let right = cross(forward, unit(up, [0, 1, 0]));
  if (length(right) < 1e-9) {
    // The camera looks along `up`, so any horizontal direction works.
    right = cross(forward, Math.abs(forward[0]) < 0.9 ? [1, 0, 0] : [0, 0, 1]);
  }
  right = unit(right, [1, 0, 0]);
  return {right, above: cross(right, forward), forward};
}

/** Orbits the camera about `lookAt`: by `yaw` about `up`, counter-clockwise seen from above, then by `pitch` upwards; radians. */
export function orbited(pose: Pose, yaw: number, pitch: number): Pose {
  const axis = unit(pose.up, [0, 1, 0]);
  const turned: Pose = {...pose, eye: plus(pose.lookAt, rotated(minus(pose.eye, pose.lookAt), axis, yaw))};
  const offset = minus(turned.eye, pose.lookAt);
  const {right} = frameOf(turned);
  const polar = Math.atan2(length(cross(axis, offset)), dot(axis, offset));
  const next = Math.min(Math.max(polar - pitch, kMinPolar), Math.PI - kMinPolar);
  // A positive rotation about `right` leads away from `up`.
  return {...turned, eye: plus(pose.lookAt, rotated(offset, right, next - polar))};
}

/** Moves camera and `lookAt` so that the point at `lookAt` moves `x` to the right and `y` downwards, in picture heights. */
export function panned(pose: Pose, fovDegrees: number, x: number, y: number): Pose {
  const {right, above} = frameOf(pose);
  const height = 2 * length(minus(pose.lookAt, pose.eye)) * Math.tan((fovDegrees * Math.PI) / 360);
  const by = plus(times(right, -x * height), times(above, y * height));
  return {...pose, eye: plus(pose.eye, by), lookAt: plus(pose.lookAt, by)};
}

/** Multiplies the distance to `lookAt`. */
export function dollied(pose: Pose, factor: number): Pose {
  const offset = minus(pose.eye, pose.lookAt);
  const distance = Math.min(Math.max(length(offset) * factor, kMinDistance), kMaxDistance);
  return {...pose, eye: plus(pose.lookAt, times(unit(offset, [0, 0, 1]), distance))};
}
