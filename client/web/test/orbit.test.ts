import {expect, test} from 'vitest';
import {dollied, dot, frameOf, length, minus, orbited, panned, rotated, type Pose, type Vector} from '../src/model/orbit';

const close = (a: Vector, b: Vector) => a.forEach((value, i) => expect(value).toBeCloseTo(b[i]!, 12));
const kFront: Pose = {eye: [0, 0, 5], lookAt: [0, 0, 0], up: [0, 1, 0]};

test('rotation follows the right-hand rule', () => {
  close(rotated([1, 0, 0], [0, 0, 1], Math.PI / 2), [0, 1, 0]);
  close(rotated([0, 1, 0], [1, 0, 0], Math.PI / 2), [0, 0, 1]);
  close(rotated([0, 0, 1], [0, 1, 0], Math.PI / 2), [1, 0, 0]);
  close(rotated([1, 2, 3], [0, 0, 1], Math.PI), [-1, -2, 3]);
  // About the diagonal, a third of a turn permutes the axes.
  const third = 1 / Math.sqrt(3);
  close(rotated([1, 2, 3], [third, third, third], (2 * Math.PI) / 3), [3, 1, 2]);
});

test('a camera at the front has +x on the right and +y above', () => {
  const {right, above, forward} = frameOf(kFront);
  close(right, [1, 0, 0]);
  close(above, [0, 1, 0]);
  close(forward, [0, 0, -1]);
});

test('orbit rotates the camera about its target', () => {
  close(orbited(kFront, Math.PI / 2, 0).eye, [5, 0, 0]);
  close(orbited(kFront, Math.PI, 0).eye, [0, 0, -5]);
  close(orbited(kFront, 0, Math.PI / 6).eye, [0, 2.5, 5 * Math.cos(Math.PI / 6)]);
  close(orbited(kFront, Math.PI / 2, -Math.PI / 4).eye, [5 / Math.SQRT2, -5 / Math.SQRT2, 0]);
});

test('orbit keeps the distance, can be reversed, and stops before the poles', () => {
  const pose: Pose = {eye: [278, 273, -800], lookAt: [278, 200, 279], up: [0.1, 2, 0]};
  const distance = length(minus(pose.eye, pose.lookAt));
  const there = orbited(pose, 0.7, 0.3);
  expect(length(minus(there.eye, there.lookAt))).toBeCloseTo(distance, 9);
  const back = orbited(orbited(there, 0, -0.3), -0.7, 0);
  back.eye.forEach((value, i) => expect(value).toBeCloseTo(pose.eye[i]!, 9));
  for (const pitch of [10, -10]) {
    const {eye} = orbited(kFront, 0, pitch);
    expect(Math.abs(eye[1])).toBeCloseTo(5 * Math.cos(Math.PI / 180), 9);
    expect(eye[2]).toBeGreaterThan(0);
  }
});

test('pan keeps the target under the finger', () => {
  // With 90 degrees the picture is as high as twice the distance.
  const moved = panned(kFront, 90, 0.5, 0.25);
  close(moved.eye, [-5, 2.5, 5]);
  close(moved.lookAt, [-5, 2.5, 0]);
});

test('dolly scales the distance, and never reaches the target', () => {
  close(dollied(kFront, 0.5).eye, [0, 0, 2.5]);
  expect(dollied(kFront, 0).eye[2]).toBeGreaterThan(0);
  expect(length(dollied(kFront, 1e300).eye)).toBeLessThan(1e12);
});

test('a camera that looks straight down, or at its own position, has a frame', () => {
  for (const eye of [[0, 5, 0], [0, 0, 0]] as Vector[]) {
    const {right, above, forward} = frameOf({...kFront, eye});
    expect(length(right)).toBeCloseTo(1, 12);
    expect(Math.abs(dot(right, forward)) + Math.abs(dot(above, forward))).toBeCloseTo(0, 12);
    expect(orbited({...kFront, eye}, 0.1, 0.1).eye.every(Number.isFinite)).toBe(true);
  }
});
