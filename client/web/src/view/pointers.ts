/** Mouse, pen and finger actions on the picture. */
import {useEffect, useRef} from 'preact/hooks';
import type {Point} from '../model/camera';

export interface PointerActions {
  /** A drag of the picture. `second`: with two fingers, another button than the first, or Shift. */
  move: (by: Point, second: boolean) => void;
  /** The end of a drag. */
  release: () => void;
  zoom: (at: Point, factor: number) => void;
  point: (at: Point | undefined) => void;
  /** A region is drawn from one point to another: with Shift, or if `drawing`. */
  draw: (from: Point, to: Point) => void;
  drawing: boolean;
  /** Every drag moves, and none draws, whatever Shift and `drawing` say. */
  steering: boolean;
}

/** One pointer drags or draws, two also zoom. Points are on the canvas, in CSS pixels. */
export function usePointers(canvas: {current: HTMLCanvasElement | null}, actions: PointerActions) {
  const latest = useRef(actions);
  latest.current = actions;
  useEffect(() => {
    const element = canvas.current!;
    const down = new Map<number, Point>();
    /** The first corner of the region being drawn. */
    let corner: Point | undefined;
    let second = false;
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
      const {drawing, steering} = latest.current;
      second = event.shiftKey || event.button !== 0;
      corner = down.size === 1 && !steering && (drawing || event.shiftKey) ? place(event) : undefined;
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
        latest.current.move({x: middle.x - spreadBefore.middle.x, y: middle.y - spreadBefore.middle.y}, true);
        latest.current.zoom(middle, spreadNow.distance / Math.max(spreadBefore.distance, 1));
      } else if (corner) {
        latest.current.draw(corner, at);
      } else {
        latest.current.move({x: at.x - before.x, y: at.y - before.y}, second);
      }
    };
    const onUp = (event: PointerEvent) => {
      if (down.delete(event.pointerId) && down.size === 0) {
        latest.current.release();
      }
    };
    const onMenu = (event: MouseEvent) => {
      // The second button moves the camera.
      if (latest.current.steering) {
        event.preventDefault();
      }
    };
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
    element.addEventListener('contextmenu', onMenu);
    element.addEventListener('wheel', onWheel, {passive: false});
    return () => {
      element.removeEventListener('pointerdown', onDown);
      element.removeEventListener('pointermove', onMove);
      element.removeEventListener('pointerup', onUp);
      element.removeEventListener('pointercancel', onUp);
      element.removeEventListener('pointerleave', onLeave);
      element.removeEventListener('contextmenu', onMenu);
      element.removeEventListener('wheel', onWheel);
    };
  }, []);
}
