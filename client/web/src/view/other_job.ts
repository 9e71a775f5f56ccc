/** A second watched job. It has a connection of its own, because a connection brings the pixels of one job. */
import {useEffect, useState} from 'preact/hooks';
import {Live} from '../api/live';
import {Film} from '../model/film';
import {failureOf, kNoFailures, withLayerFailures} from '../model/layers';
import type {Job} from '../wire/lightmill/v1/farm_pb';
import {farm} from './store';

export interface OtherJob {
  job: Job | undefined;
  film: Film | undefined;
  failure: string;
}

const kNone: OtherJob = {job: undefined, film: undefined, failure: ''};

export function useOtherJob(id: bigint | undefined): OtherJob {
  const [state, setState] = useState(kNone);
  useEffect(() => {
    if (id === undefined) {
      return;
    }
    let now = kNone;
    let noPicture = '';
    const live = new Live({
      onLink: () => undefined,
      onUpdate: ({job, jobFailure, layerFailures, tiles}) => {
        if (jobFailure) {
          now = {...now, failure: jobFailure};
          setState(now);
        } else if (job && job.id === id) {
          now = {job, film: now.film?.isOf(job) ? now.film : Film.of(job), failure: noPicture};
          setState(now);
        }
        if (layerFailures.length > 0) {
          noPicture = failureOf(withLayerFailures(kNoFailures, layerFailures), ['']);
          now = {...now, failure: noPicture};
          setState(now);
        }
        farm.putTiles(now.film, tiles);
      },
    });
    live.want({jobs: false, workers: false, job: id});
    return () => {
      live.close();
      setState(kNone);
    };
  }, [id]);
  return state;
}
