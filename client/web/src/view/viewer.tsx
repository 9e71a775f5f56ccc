/** The picture: drawn as it comes, moved by wheel, fingers and keys, and read pixel by pixel. */
import {useEffect, useLayoutEffect, useRef, useState} from 'preact/hooks';
import {fit, pan, toPicture, zoomAt, type Camera, type Point, type Size} from '../model/camera';
import type {Film} from '../model/film';
import {kMostStops, kPlainLook, type Look} from '../model/route';
import {GlPicture} from './gl_picture';
import {farm} from './store';

export interface ViewerProps {
  film: Film | undefined;
  look: Look;
  /** Undefined: all of the picture. */
  camera: Camera | undefined;
  theme: string;
  onLook: (look: Look) => void;
  onCamera: (camera: Camera | undefined) => void;
  /** The pixel that is pointed at, of the crop; undefined where there is none. */
  onPoint: (at: Point | undefined) => void;
  /** The exposure that fits the picture. */
  onNormalize: () => void;
}

const kPanPixels = 40;
const kKeyZoom = 1.25;

function backgroundOf(element: HTMLElement): [number, number, number] {
  const parts = getComputedStyle(element).backgroundColor.match(/[\d.]+/g)?.map(Number) ?? [];
  return [(parts[0] ?? 0) / 255, (parts[1] ?? 0) / 255, (parts[2] ?? 0) / 255];
}

/** Mouse, pen and fingers: one drags, two also zoom. */
function usePointers(
  canvas: {current: HTMLCanvasElement | null},
  move: (by: Point) => void,
  zoom: (at: Point, factor: number) => void,
  point: (at: Point | undefined) => void,
) {
  const latest = useRef({move, zoom, point});
  latest.current = {move, zoom, point};
  useEffect(() => {
    const element = canvas.current!;
    const down = new Map<number, Point>();
    const place = (event: MouseEvent): Point => {
      const box = element.getBoundingClientRect();
      return {x: event.clientX - box.left, y: event.clientY - box.top};
    };
    const spread = () => {
      const [a, b] = [...down.values()];
      return a && b ? {middle: {x: (a.x + b.x) / 2, y: (a.y + b.y) / 2}, distance: Math.hypot(a.x - b.x, a.y - b.y)} : undefined;
    };
    const onDown = (event: PointerEvent) => {
      element.setPointerCapture(event.pointerId);
      down.set(event.pointerId, place(event));
      latest.current.point(place(event));
    };
    const onMove = (event: PointerEvent) => {
      const at = place(event);
      latest.current.point(at);
      const before = down.get(event.pointerId);
      if (!before) {
        return;
      }
      const spreadBefore = spread();
      down.set(event.pointerId, at);
      const spreadNow = spread();
      if (spreadBefore && spreadNow) {
        const {middle} = spreadNow;
        latest.current.move({x: middle.x - spreadBefore.middle.x, y: middle.y - spreadBefore.middle.y});
        latest.current.zoom(middle, spreadNow.distance / Math.max(spreadBefore.distance, 1));
      } else {
        latest.current.move({x: at.x - before.x, y: at.y - before.y});
      }
    };
    const onUp = (event: PointerEvent) => down.delete(event.pointerId);
    const onLeave = () => latest.current.point(undefined);
    const onWheel = (event: WheelEvent) => {
      event.preventDefault();
      const lines = event.deltaMode === WheelEvent.DOM_DELTA_LINE ? 16 : 1;
      latest.current.zoom(place(event), Math.exp((-event.deltaY * lines) / 400));
    };
    element.addEventListener('pointerdown', onDown);
    element.addEventListener('pointermove', onMove);
    element.addEventListener('pointerup', onUp);
    element.addEventListener('pointercancel', onUp);
    element.addEventListener('pointerleave', onLeave);
    element.addEventListener('wheel', onWheel, {passive: false});
    return () => {
      element.removeEventListener('pointerdown', onDown);
      element.removeEventListener('pointermove', onMove);
      element.removeEventListener('pointerup', onUp);
      element.removeEventListener('pointercancel', onUp);
      element.removeEventListener('pointerleave', onLeave);
      element.removeEventListener('wheel', onWheel);
    };
  }, []);
}

export function Viewer({film, look, camera, theme, onLook, onCamera, onPoint, onNormalize}: ViewerProps) {
  const canvas = useRef<HTMLCanvasElement>(null);
  const picture = useRef<GlPicture>();
  const redraw = useRef(() => {});
  const [screen, setScreen] = useState<Size>({width: 1, height: 1});
  const [failure, setFailure] = useState('');
  const size: Size = film ? film.crop : {width: 1, height: 1};
  const shown = camera ?? fit(size, screen);

  useLayoutEffect(() => {
    const element = canvas.current!;
    try {
      picture.current = new GlPicture(element);
    } catch (error) {
      setFailure(String(error instanceof Error ? error.message : error));
    }
    const observer = new ResizeObserver(() => setScreen({width: element.clientWidth, height: element.clientHeight}));
    observer.observe(element);
    return () => observer.disconnect();
  }, []);

  // However much changes, it is drawn once a frame.
  const frame = useRef(0);
  redraw.current = () => {
    frame.current ||= requestAnimationFrame(() => {
      frame.current = 0;
      const element = canvas.current;
      if (picture.current && element && film) {
        picture.current.draw({camera: shown, look, screen, scale: window.devicePixelRatio, background: backgroundOf(element)});
        element.dataset.drawn = 'yes';
      }
    });
  };
  useEffect(() => {
    if (film && picture.current) {
      try {
        picture.current.setFilm(film);
        setFailure('');
      } catch (error) {
        setFailure(String(error instanceof Error ? error.message : error));
      }
    }
  }, [film]);
  useEffect(
    () =>
      farm.onTiles((changed, tiles) => {
        if (changed === film) {
          picture.current?.putTiles(changed, tiles);
          redraw.current();
        }
      }),
    [film],
  );
  useEffect(() => {
    // What waits was asked for with what was before.
    cancelAnimationFrame(frame.current);
    frame.current = 0;
    redraw.current();
  }, [film, look, camera, screen, theme]);

  const move = (by: Point) => onCamera(pan(shown, size, by));
  const zoom = (at: Point, factor: number) => onCamera(zoomAt(shown, screen, at, factor));
  usePointers(canvas, move, zoom, (at) => onPoint(at && toPicture(shown, screen, at)));

  const middle = {x: screen.width / 2, y: screen.height / 2};
  const onKey = (event: KeyboardEvent) => {
    if (event.ctrlKey || event.metaKey || event.altKey) {
      return;
    }
    const step = event.shiftKey ? -1 : 1;
    const brighter = (stops: number) =>
      onLook({...look, exposure: Math.min(Math.max(look.exposure + stops, -kMostStops), kMostStops)});
    const moved = (by: Point) => {
      move(by);
      onPoint(shown.center);
    };
    const keys: Record<string, () => void> = {
      arrowleft: () => moved({x: kPanPixels, y: 0}),
      arrowright: () => moved({x: -kPanPixels, y: 0}),
      arrowup: () => moved({x: 0, y: kPanPixels}),
      arrowdown: () => moved({x: 0, y: -kPanPixels}),
      '+': () => zoom(middle, kKeyZoom),
      '=': () => zoom(middle, kKeyZoom),
      '-': () => zoom(middle, 1 / kKeyZoom),
      f: () => onCamera(undefined),
      '1': () => onCamera({zoom: 1, center: shown.center}),
      e: () => brighter(0.5 * step),
      n: onNormalize,
      v: () => onLook({...look, view: look.view === 'plain' ? 'filmic' : 'plain'}),
      r: () => onLook(kPlainLook),
    };
    const key = keys[event.key.toLowerCase()];
    if (key) {
      event.preventDefault();
      key();
    }
  };

  return (
    <div class="viewer">
      <canvas
        ref={canvas}
        tabIndex={0}
        role="img"
        aria-label="The picture. Arrows move it, plus and minus zoom, F fits it, E and Shift+E change the exposure."
        aria-describedby="viewer-keys"
        onKeyDown={onKey}
        onDblClick={() => onCamera(undefined)}
      />
      {failure && (
        <p class="notice failure over" role="alert">
          {failure}
        </p>
      )}
    </div>
  );
}
