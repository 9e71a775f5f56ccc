/** Other jobs in the error chart. They are polled while they change and the page is visible. */
import {useEffect, useState} from 'preact/hooks';
import {fetchJob} from '../api/history';
import {hasEnded} from '../model/jobs';
import type {Job} from '../wire/lightmill/v1/farm_pb';
import {useFarm} from './store';

const kEveryMs = 4_000;

/** The known jobs, in the order of `ids`, and the last failure. */
export function useChartedJobs(ids: readonly bigint[]): [Job[], string] {
  const [known, setKnown] = useState<ReadonlyMap<bigint, Job>>(new Map());
  const [failure, setFailure] = useState('');
  const {link} = useFarm();
  const asked = ids.join();
  useEffect(() => {
    let stopped = false;
    const seen = new Map<bigint, Job>();
    const poll = async () => {
      for (const id of ids) {
        const before = seen.get(id);
        if (document.hidden || (before && hasEnded(before.state))) {
          continue;
        }
        try {
          seen.set(id, await fetchJob(id));
        } catch (error) {
          if (!stopped) {
            setFailure(`Job ${id} is not in the chart: ${error instanceof Error ? error.message : String(error)}`);
          }
        }
      }
      if (!stopped) {
        setKnown(new Map(seen));
      }
    };
    setFailure('');
    void poll();
    const timer = setInterval(() => void poll(), kEveryMs);
    return () => {
      stopped = true;
      clearInterval(timer);
    };
    // After a reconnection the farm may have other jobs, or newer states of these.
  }, [asked, link === 'connected']);
  return [ids.map((id) => known.get(id)).filter((job) => job !== undefined), failure];
}
