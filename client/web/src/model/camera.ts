/** The visible part of the picture: zoom and pan. Pure. Lengths on the screen are in CSS pixels. */

export interface Size {
  width: number;
  height: number;
}
export interface Point {
  x: number;
  y: number;
}

export interface Camera {
  /** CSS pixels per picture pixel. */
  zoom: number;
  /** The picture's point in the middle of the screen. */
  center: Point;
}

export const kMaxZoom = 64;
export const kMinZoom = 1 / 64;

/** The whole picture, centred. */
export function fit(picture: Size, screen: Size): Camera {
  const zoom = Math.min(screen.width / picture.width, screen.height / picture.height);
  return {zoom: clampZoom(zoom), center: {x: picture.width / 2, y: picture.height / 2}};
}

function clampZoom(zoom: number): number {
  return Math.min(Math.max(zoom, kMinZoom), kMaxZoom);
}

/** The picture's point at a point of the screen. */
export function toPicture(camera: Camera, screen: Size, at: Point): Point {
  return {
    x: camera.center.x + (at.x - screen.width / 2) / camera.zoom,
    y: camera.center.y + (at.y - screen.height / 2) / camera.zoom,
  };
}

export function toScreen(camera: Camera, screen: Size, at: Point): Point {
  return {
    x: screen.width / 2 + (at.x - camera.center.x) * camera.zoom,
    y: screen.height / 2 + (at.y - camera.center.y) * camera.zoom,
  };
}

/** Zooms so that the point at `at` stays in place. */
export function zoomAt(camera: Camera, screen: Size, at: Point, factor: number): Camera {
  const below = toPicture(camera, screen, at);
  const zoom = clampZoom(camera.zoom * factor);
  return {
    zoom,
    center: {x: below.x - (at.x - screen.width / 2) / zoom, y: below.y - (at.y - screen.height / 2) / zoom},
  };
}

/** Moves the picture by this much of the screen. The screen's middle stays within the picture. */
export function pan(camera: Camera, picture: Size, by: Point): Camera {
  const clamp = (value: number, most: number) => Math.min(Math.max(value, 0), most);
  return {
    zoom: camera.zoom,
    center: {
      x: clamp(camera.center.x - by.x / camera.zoom, picture.width),
      y: clamp(camera.center.y - by.y / camera.zoom, picture.height),
    },
  };
}
