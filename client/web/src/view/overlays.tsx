/** Overlays of the picture: the divider between two pictures, and the measured region. */
import {toScreen, type Camera, type Size} from '../model/camera';
import type {Rect} from '../model/film';

const kStep = 0.02;

export function Divider({split, onSplit}: {split: number; onSplit: (split: number) => void}) {
  const set = (value: number) => onSplit(Math.min(Math.max(value, 0), 1));
  const onKey = (event: KeyboardEvent) => {
    const to = {ArrowLeft: split - kStep, ArrowRight: split + kStep, Home: 0, End: 1}[event.key];
    if (to !== undefined) {
      event.preventDefault();
      set(to);
    }
  };
  const onMove = (event: PointerEvent) => {
    const handle = event.currentTarget as HTMLElement;
    if (handle.hasPointerCapture(event.pointerId)) {
      const box = handle.parentElement!.getBoundingClientRect();
      set((event.clientX - box.left) / box.width);
    }
  };
  return (
    <div
      class="divider"
      role="separator"
      aria-orientation="vertical"
      aria-label="Divider: this picture on the left, the reference on the right"
      aria-valuemin={0}
      aria-valuemax={100}
      aria-valuenow={Math.round(100 * split)}
      tabIndex={0}
      style={{left: `${100 * split}%`}}
      onKeyDown={onKey}
      onPointerDown={(event) => event.currentTarget.setPointerCapture(event.pointerId)}
      onPointerMove={onMove}
    />
  );
}

export function RegionFrame({region, camera, screen}: {region: Rect; camera: Camera; screen: Size}) {
  const from = toScreen(camera, screen, region);
  const style = {
    left: `${from.x}px`,
    top: `${from.y}px`,
    width: `${region.width * camera.zoom}px`,
    height: `${region.height * camera.zoom}px`,
  };
  return <div class="region-frame" aria-hidden="true" style={style} />;
}
