/** The values of the pixel below the pointer, and the histogram of all pixels. */
import {useEffect, useRef, useState} from 'preact/hooks';
import type {Point} from '../model/camera';
import {histogramOf, type Film, type Pixel} from '../model/film';
import {valueText} from '../model/format';
import {farm} from './store';

/** Counts up when the film's pixels have changed, at most once per `everyMs`. */
export function useFilmVersion(film: Film | undefined, everyMs: number): number {
  const [version, setVersion] = useState(0);
  useEffect(() => {
    let timer: ReturnType<typeof setTimeout> | undefined;
    const stop = farm.onTiles((changed) => {
      if (changed === film) {
        timer ??= setTimeout(() => {
          timer = undefined;
          setVersion((before) => before + 1);
        }, everyMs);
      }
    });
    return () => {
      stop();
      clearTimeout(timer);
    };
  }, [film, everyMs]);
  return version;
}

function rowsOf(pixel: Pixel | undefined): [string, string][] {
  const value = (of: number | undefined) => (of === undefined || !pixel?.samples ? '–' : valueText(of));
  return [
    ['R', value(pixel?.rgb[0])],
    ['G', value(pixel?.rgb[1])],
    ['B', value(pixel?.rgb[2])],
    ['Luminance', value(pixel?.luminance)],
    ['Standard error', value(pixel?.standardError)],
    ['Samples', pixel ? String(pixel.samples) : '–'],
  ];
}

/** Shows both pictures, if there is a reference. */
export function PixelInspector({film, other, at}: {film: Film | undefined; other: Film | undefined; at: Point | undefined}) {
  useFilmVersion(film, 300);
  const [x, y] = [Math.floor(at?.x ?? -1), Math.floor(at?.y ?? -1)];
  const pixel = film?.pixel(x, y);
  const rows = rowsOf(pixel);
  const otherRows = other && rowsOf(other.pixel(x, y));
  return (
    <section class="panel" aria-labelledby="pixel-title">
      <h2 id="pixel-title">
        Pixel{' '}
        <span class="muted">{pixel && film ? `${film.crop.x + x}, ${film.crop.y + y}` : 'point at the picture'}</span>
      </h2>
      <dl class="pixel">
        {rows.map(([name, value], i) => (
          <div key={name}>
            <dt>{name}</dt>
            <dd>{value}</dd>
            {otherRows && <dd class="muted">{otherRows[i]![1]}</dd>}
          </div>
        ))}
      </dl>
    </section>
  );
}

const kColors = ['#e5484d', '#30a46c', '#3b82f6'];

export function HistogramView({film, exposure}: {film: Film | undefined; exposure: number}) {
  const canvas = useRef<HTMLCanvasElement>(null);
  const version = useFilmVersion(film, 700);
  useEffect(() => {
    const element = canvas.current;
    const context = element?.getContext('2d');
    if (!element || !context || !film) {
      return;
    }
    const scale = window.devicePixelRatio;
    const [width, height] = [element.clientWidth, element.clientHeight];
    element.width = width * scale;
    element.height = height * scale;
    context.scale(scale, scale);
    const histogram = histogramOf(film);
    const place = (stops: number) => ((stops - histogram.least) / (histogram.most - histogram.least)) * width;
    const ink = getComputedStyle(element).color;
    // The range that is displayed as white.
    context.fillStyle = ink;
    context.globalAlpha = 0.1;
    context.fillRect(place(-exposure), 0, width, height);
    context.globalAlpha = 1;
    // The outer bins are left out of the maximum, because they hold all values beyond, such as black.
    const most = Math.max(...histogram.bins.map((channel) => Math.max(...channel.slice(1, -1))), 1e-6);
    context.globalCompositeOperation = 'source-over';
    histogram.bins.forEach((channel, c) => {
      context.beginPath();
      context.moveTo(0, height);
      channel.forEach((share, i) =>
        context.lineTo(((i + 0.5) / channel.length) * width, height - Math.sqrt(Math.min(share / most, 1)) * (height - 4)),
      );
      context.lineTo(width, height);
      context.globalAlpha = 0.28;
      context.fillStyle = kColors[c]!;
      context.fill();
      context.globalAlpha = 0.9;
      context.strokeStyle = kColors[c]!;
      context.stroke();
    });
  }, [film, version, exposure]);
  return (
    <section class="panel" aria-labelledby="histogram-title">
      <h2 id="histogram-title">
        Histogram <span class="muted">stops, 2⁻¹² to 2⁸</span>
      </h2>
      <canvas ref={canvas} class="histogram" role="img" aria-label="Histogram of red, green and blue, from dark to bright. The shaded part is brighter than white." />
    </section>
  );
}
