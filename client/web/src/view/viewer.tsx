/** The picture: drawn as it arrives, moved by wheel, fingers and keys. */
import {useEffect, useLayoutEffect, useRef, useState} from 'preact/hooks';
import {fit, pan, toPicture, zoomAt, type Camera, type Point, type Size} from '../model/camera';
import type {Against} from '../model/comparison';
import type {Film, Rect} from '../model/film';
import {movedRegion, regionBetween, within} from '../model/region';
import type {DisplaySettings} from '../model/route';
import {GlPicture} from './gl_picture';
import {MeterMarks, type MeterRow} from './meters';
import {Divider, RegionFrame} from './overlays';
import {usePointers} from './pointers';
import {farm} from './store';
import {steeringKeys, viewerKeys} from './viewer_keys';

export interface ViewerProps {
  film: Film | undefined;
  display: DisplaySettings;
  /** Undefined: the whole picture. */
  camera: Camera | undefined;
  theme: string;
  /** The reference, of the same size; undefined until it arrives. */
  other: Film | undefined;
  against: Against | undefined;
  /** The difference of the two at each pixel. */
  errorMap: Float32Array | undefined;
  /** The photon overlay, of the same size. */
  photonMap: Film | undefined;
  /** Meters drawn over the picture. */
  meters: readonly MeterRow[];
  region: Rect | undefined;
  /** Whether dragging draws a region instead of moving the picture. */
  drawing: boolean;
  onDisplay: (display: DisplaySettings) => void;
  onCamera: (camera: Camera | undefined) => void;
  onAgainst: (against: Against) => void;
  onRegion: (region: Rect | undefined) => void;
  onDrawing: (drawing: boolean) => void;
  /** Called when a file is dropped on the picture. */
  onFile: (file: File) => void;
  /** The pixel of the crop below the pointer; undefined if there is none. */
  onPoint: (at: Point | undefined) => void;
  /** Sets the exposure that fits the picture. */
  onNormalize: () => void;
  /** Moves the scene's camera. If set, drags, wheel and keys go to it, and not to the picture. */
  steering?: Steering;
}

/** Distances are fractions of the picture's height. */
export interface Steering {
  orbit: (x: number, y: number) => void;
  pan: (x: number, y: number) => void;
  /** Multiplies the distance. */
  dolly: (factor: number) => void;
  /** The end of a drag. */
  release: () => void;
}

function backgroundOf(element: HTMLElement): [number, number, number] {
  const parts = getComputedStyle(element).backgroundColor.match(/[\d.]+/g)?.map(Number) ?? [];
  return [(parts[0] ?? 0) / 255, (parts[1] ?? 0) / 255, (parts[2] ?? 0) / 255];
}

export function Viewer(props: ViewerProps) {
  const {film, display, camera, theme, other, photonMap, against, errorMap, region, drawing, steering, onCamera, onPoint} = props;
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

  // At most one redraw per frame.
  const frame = useRef(0);
  redraw.current = () => {
    frame.current ||= requestAnimationFrame(() => {
      frame.current = 0;
      const element = canvas.current;
      if (picture.current && element && film) {
        const measured = against?.how === 'flip' || against?.how === 'hdr-flip';
        const how = !against || (measured && !errorMap) ? 'picture' : against.how;
        const split = against?.split ?? 1;
        picture.current.draw({camera: shown, display, how, split, screen, scale: window.devicePixelRatio, background: backgroundOf(element)});
        element.dataset.drawn = 'yes';
      }
    });
  };
  useEffect(() => {
    if (film && picture.current) {
      try {
        picture.current.setFilm(film);
        picture.current.setOther(other);
        picture.current.setPhotons(photonMap);
        setFailure('');
      } catch (error) {
        setFailure(String(error instanceof Error ? error.message : error));
      }
    }
  }, [film, other, photonMap]);
  useEffect(() => {
    if (errorMap) {
      picture.current?.setErrorMap(errorMap);
    }
  }, [errorMap]);
  useEffect(
    () =>
      farm.onTiles((changed, tiles) => {
        if (changed === film || changed === other || changed === photonMap) {
          picture.current?.putTiles(changed, tiles);
          redraw.current();
        }
      }),
    [film, other, photonMap],
  );
  useEffect(() => {
    // A pending redraw has the old values.
    cancelAnimationFrame(frame.current);
    frame.current = 0;
    redraw.current();
  }, [film, display, camera, screen, theme, other, photonMap, against, errorMap]);

  // Several moves may come before the first is drawn. Each starts from the one before.
  const current = useRef(shown);
  current.current = shown;
  const aim = (next: Camera) => {
    current.current = next;
    onCamera(next);
  };
  const move = (by: Point) => aim(pan(current.current, size, by));
  const zoom = (at: Point, factor: number) => aim(zoomAt(current.current, screen, at, factor));
  const steer = (by: Point, second: boolean) => {
    const height = shown.zoom * size.height;
    (second ? steering!.pan : steering!.orbit)(by.x / height, by.y / height);
  };
  usePointers(canvas, {
    move: steering ? steer : move,
    zoom: steering ? (_at, factor) => steering.dolly(1 / factor) : zoom,
    release: () => steering?.release(),
    steering: steering !== undefined,
    point: (at) => onPoint(at && toPicture(shown, screen, at)),
    draw: (from, to) => film && props.onRegion(regionBetween(toPicture(shown, screen, from), toPicture(shown, screen, to), size)),
    drawing,
  });

  const changeRegion = (by: Partial<Rect>) => {
    // The first region is a quarter of the visible width and height, in the middle.
    const [width, height] = [Math.ceil(screen.width / shown.zoom / 4), Math.ceil(screen.height / shown.zoom / 4)];
    const first = {x: Math.floor(shown.center.x - width / 2), y: Math.floor(shown.center.y - height / 2), width, height};
    props.onRegion(movedRegion(region ?? first, by, size));
  };
  const onKey = (event: KeyboardEvent) => {
    if (event.ctrlKey || event.metaKey || event.altKey) {
      return;
    }
    const moved = (by: Point) => {
      move(by);
      onPoint(shown.center);
    };
    const around = (factor: number) => zoom({x: screen.width / 2, y: screen.height / 2}, factor);
    const keys = viewerKeys({...props, camera: shown, move: moved, zoom: around, changeRegion}, event.shiftKey);
    const key = (steering ? {...keys, ...steeringKeys(steering, event.shiftKey)} : keys)[event.key.toLowerCase()];
    if (key) {
      event.preventDefault();
      key();
    }
  };
  const onDrop = (event: DragEvent) => {
    event.preventDefault();
    const file = event.dataTransfer?.files[0];
    if (file) {
      props.onFile(file);
    }
  };
  const framed = region && film && within(region, size);

  return (
    <div class="viewer" onDragOver={(event) => event.preventDefault()} onDrop={onDrop}>
      <canvas
        ref={canvas}
        tabIndex={0}
        role="img"
        aria-label={steering ? 'The picture. Arrows turn the camera, with Shift they move it, plus and minus go nearer and farther.' : 'The picture. Arrows move it, plus and minus zoom, F fits it, E and Shift+E change the exposure.'}
        aria-describedby="viewer-keys"
        onKeyDown={onKey}
        onDblClick={() => onCamera(undefined)}
      />
      {props.meters.length > 0 && film && <MeterMarks rows={props.meters} camera={shown} screen={screen} />}
      {framed && <RegionFrame region={framed} camera={shown} screen={screen} />}
      {against?.how === 'split' && other && <Divider split={against.split} onSplit={(split) => props.onAgainst({...against, split})} />}
      {failure && (
        <p class="notice failure over" role="alert">
          {failure}
        </p>
      )}
    </div>
  );
}
