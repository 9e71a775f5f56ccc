/** The farm's history as series for charts. Unknown values are gaps. */
import type {FarmHistory, FarmSample, WorkerHistory} from '../wire/lightmill/v1/web_pb';

/** Time spans of the charts, in seconds. */
export const kSpans = [
  {seconds: 600, name: '10 minutes'},
  {seconds: 3600, name: 'hour'},
  {seconds: 86400, name: 'day'},
] as const;

/** Samples whose ends are further apart than this many intervals have a gap between them. */
const kLongest = 2.5;
/** The least length of an axis, in intervals, also for a coordinator that has just started. */
const kMinShown = 15;

export type Column = (number | null)[];

/** Times in Unix seconds, and a value of each kind for each time. */
export interface FarmSeries {
  times: number[];
  /** Pixel samples per second. */
  rate: Column;
  threads: Column;
  busy: Column;
  running: Column;
  waiting: Column;
}

/** The first and last time of an axis, in Unix seconds. */
export type TimeWindow = readonly [number, number];

function windowOf(begin: number, end: number, interval: number): TimeWindow {
  return [Math.min(begin, end - kMinShown * interval), end];
}

/** The range of an axis of `span` seconds. It begins with the first known value. */
export function farmWindow(history: FarmHistory, span: number): TimeWindow {
  const end = Number(history.unixMs) / 1000;
  const first = history.samples[0];
  const known = first ? Number(first.unixMs) / 1000 - first.seconds : end;
  return windowOf(Math.max(known, end - span), end, history.intervalSeconds);
}

/** Indices of values with a gap on both sides. No line goes through them. */
export function lonely(column: Column): number[] {
  const known = (at: number) => (column[at] ?? null) !== null;
  return [...column.keys()].filter((at) => known(at) && !known(at - 1) && !known(at + 1));
}

export function seriesOf(history: FarmHistory): FarmSeries {
  const series: FarmSeries = {times: [], rate: [], threads: [], busy: [], running: [], waiting: []};
  const put = (seconds: number, sample?: FarmSample) => {
    series.times.push(seconds);
    series.rate.push(sample && sample.seconds > 0 ? sample.pixelSamples / sample.seconds : null);
    series.threads.push(sample?.threads ?? null);
    series.busy.push(sample?.busyThreads ?? null);
    series.running.push(sample?.jobsRunning ?? null);
    series.waiting.push(sample?.jobsWaiting ?? null);
  };
  for (const sample of history.samples) {
    const end = Number(sample.unixMs) / 1000;
    const before = series.times.at(-1);
    // After a machine slept, only the wall clock shows the gap.
    if (before !== undefined && end - before > kLongest * history.intervalSeconds) {
      put((before + end) / 2);
    }
    put(end, sample);
  }
  return series;
}

/** The mean share of busy threads, in percent; undefined if there were no threads. */
export function utilisation(history: FarmHistory): number | undefined {
  let [busy, all] = [0, 0];
  for (const {seconds, threads, busyThreads} of history.samples) {
    busy += busyThreads * seconds;
    all += threads * seconds;
  }
  return all > 0 ? (100 * busy) / all : undefined;
}

export function csvOfHistory(history: FarmHistory): string {
  const rows = history.samples.map((each) =>
    [
      new Date(Number(each.unixMs)).toISOString(),
      each.seconds,
      each.pixelSamples,
      each.workers,
      each.threads,
      each.busyThreads,
      each.units,
      each.jobsRunning,
      each.jobsWaiting,
    ].join(','),
  );
  return ['until,seconds,pixel_samples,workers,threads,busy_threads,units,jobs_running,jobs_waiting', ...rows, ''].join('\n');
}

/** A worker's last hour. */
export interface WorkerSeries {
  times: number[];
  /** Pixel samples per second while connected; null while it was away. */
  rate: Column;
  results: number;
  lost: number;
  /** Seconds for which it was connected. */
  seconds: number;
  window: TimeWindow;
}

export function workerSeriesOf({minutes}: WorkerHistory): WorkerSeries {
  const end = (at: number) => Number(minutes.at(at)?.unixMs ?? 0) / 1000;
  return {
    window: windowOf(end(0) - 60, end(-1), 60),
    times: minutes.map(({unixMs}) => Number(unixMs) / 1000),
    rate: minutes.map(({seconds, pixelSamples}) => (seconds > 0 ? pixelSamples / seconds : null)),
    results: minutes.reduce((sum, {results}) => sum + Number(results), 0),
    lost: minutes.reduce((sum, {leasesLost}) => sum + Number(leasesLost), 0),
    seconds: minutes.reduce((sum, {seconds}) => sum + seconds, 0),
  };
}
