/** The picture of light groups that are mixed anew, kept up with what comes. */
import {useEffect, useMemo} from 'preact/hooks';
import {Film} from '../model/film';
import {factorOf, mix, type Relight} from '../model/layers';
import type {Job} from '../wire/lightmill/v1/farm_pb';
import {farm} from './store';

/** Undefined until all of `lights` are there; they are all light layers of the job, none if nothing is mixed. */
export function useRelit(job: Job | undefined, lights: readonly string[], relight: Relight, layers: ReadonlyMap<string, Film>): Film | undefined {
  const films = lights.map((layer) => layers.get(layer));
  const complete = job !== undefined && films.length > 0 && films.every((film) => film !== undefined);
  const target = useMemo(() => (complete ? Film.of(job, 'relit') : undefined), [complete, job?.id]);
  const mixed = useMemo(() => films.flatMap((film, i) => (film ? [{film, factor: factorOf(relight.get(lights[i]!))}] : [])), [relight, ...films]);
  useEffect(() => {
    if (!target) {
      return;
    }
    const {width, height} = target.crop;
    let frame = 0;
    const all = () => {
      frame = 0;
      const rect = {x: 0, y: 0, width, height};
      mix(target, mixed, rect);
      farm.tell(target, [{rect, pixels: target.rgbe}]);
    };
    const again = () => (frame ||= requestAnimationFrame(all));
    again();
    const stop = farm.onTiles((changed) => mixed.some(({film}) => film === changed) && again());
    return () => {
      stop();
      cancelAnimationFrame(frame);
    };
  }, [target, mixed]);
  return target;
}
