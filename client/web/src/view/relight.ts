/** The mix of light groups as a film, updated as their tiles arrive. */
import {useEffect, useMemo} from 'preact/hooks';
import {Film, type Rect} from '../model/film';
import {factorOf, mix, type Relight} from '../model/layers';
import type {Job} from '../wire/lightmill/v1/farm_pb';
import {farm} from './store';

/** Undefined until all of `lights` have arrived. `lights`: all light layers of the job; empty if nothing is mixed. */
export function useRelit(job: Job | undefined, lights: readonly string[], relight: Relight, layers: ReadonlyMap<string, Film>): Film | undefined {
  const films = lights.map((layer) => layers.get(layer));
  const complete = job !== undefined && films.length > 0 && films.every((film) => film !== undefined);
  const target = useMemo(() => (complete ? Film.of(job, 'relit') : undefined), [complete, job?.id]);
  const mixed = useMemo(() => films.flatMap((film, i) => (film ? [{film, factor: factorOf(relight.get(lights[i]!))}] : [])), [relight, ...films]);
  useEffect(() => {
    if (!target) {
      return;
    }
    let frame = 0;
    let whole = true;
    // By place: tiles of several layers at the same place are mixed once.
    const changed = new Map<string, Rect>();
    const draw = () => {
      frame = 0;
      const {width, height} = target.crop;
      const rects = whole ? [{x: 0, y: 0, width, height}] : [...changed.values()];
      whole = false;
      changed.clear();
      rects.forEach((rect) => mix(target, mixed, rect));
      farm.tell(target, rects.map((rect) => ({rect, pixels: target.valuesOf(rect)})));
    };
    const again = () => (frame ||= requestAnimationFrame(draw));
    again();
    const stop = farm.onTiles((film, tiles) => {
      if (mixed.some((each) => each.film === film)) {
        tiles.forEach(({rect}) => changed.set(`${rect.x} ${rect.y}`, rect));
        again();
      }
    });
    return () => {
      stop();
      cancelAnimationFrame(frame);
    };
  }, [target, mixed]);
  return target;
}
