/** The lists of jobs and workers: how they change, and what is shown of them. */
import {JobState, type Job, type Worker} from '../wire/lightmill/v1/farm_pb';
import type {JobChanges, WorkerChanges} from '../wire/lightmill/v1/web_pb';
import {methodName, stateName} from './format';
import {isPageJob} from './job_form';

export type JobList = ReadonlyMap<bigint, Job>;
export type WorkerList = ReadonlyMap<string, Worker>;

interface Changes<Key, Item> {
  whole: boolean;
  removed: readonly Key[];
  items: readonly Item[];
}

function changed<Key, Item>(list: ReadonlyMap<Key, Item>, changes: Changes<Key, Item>, key: (item: Item) => Key) {
  const next = new Map(changes.whole ? [] : list);
  changes.removed.forEach((each) => next.delete(each));
  changes.items.forEach((each) => next.set(key(each), each));
  return next;
}

export function withJobs(list: JobList, changes: JobChanges): JobList {
  return changed(list, {...changes, items: changes.jobs}, (job) => job.id);
}

export function withWorkers(list: WorkerList, changes: WorkerChanges): WorkerList {
  return changed(list, {...changes, items: changes.workers}, (worker) => worker.name);
}

export function hasEnded(state: JobState): boolean {
  return state === JobState.DONE || state === JobState.FAILED || state === JobState.CANCELLED;
}

/** Why the page shows no pixels of a job's picture. Undefined: the job has not arrived. */
export function emptyText(job: Job | undefined): string {
  if (job && job.samplesDone === 0n) {
    return hasEnded(job.state) ? 'This job has no picture: it ended before its first sample.' : 'No samples yet.';
  }
  return 'Loading…';
}

/** The fraction done of the nearest limit, in [0, 1]. Errors fall as 1/samples. */
export function fractionDone(job: Job): number {
  if (job.state === JobState.DONE) {
    return 1;
  }
  let fraction = 0;
  if (job.samplesWanted > 0n) {
    fraction = Math.max(fraction, Number(job.samplesDone) / Number(job.samplesWanted));
  }
  if (job.goal && job.goal.seconds > 0) {
    fraction = Math.max(fraction, job.activeSeconds / job.goal.seconds);
  }
  const upper = job.error ? job.error.relMse + job.error.halfWidth : 0;
  if (job.goal && job.goal.error > 0 && upper > 0) {
    fraction = Math.max(fraction, Math.min(job.goal.error / upper, 0.99));
  }
  return Math.min(fraction, 1);
}

/** Jobs made from `parent`, oldest first, without those of live pictures. */
export function childrenOf(list: JobList, parent: bigint): bigint[] {
  const children = [...list.values()].filter((job) => job.parent === parent && !isPageJob(job.name));
  return children.map((job) => job.id).sort((a, b) => Number(a - b));
}

export type JobFilter = 'all' | 'active' | 'done' | 'failed';
export type JobOrder = 'id' | 'name' | 'state' | 'progress' | 'error' | 'eta' | 'owner' | 'method' | 'priority';

export interface JobQuery {
  search: string;
  filter: JobFilter;
  order: JobOrder;
  descending: boolean;
}

export const kNewestFirst: JobQuery = {search: '', filter: 'all', order: 'id', descending: true};

const kFilters: Record<JobFilter, (job: Job) => boolean> = {
  all: () => true,
  active: (job) => !hasEnded(job.state),
  done: (job) => job.state === JobState.DONE,
  failed: (job) => job.state === JobState.FAILED || job.state === JobState.CANCELLED,
};

const kOrders: Record<JobOrder, (job: Job) => number | string> = {
  id: (job) => Number(job.id),
  name: (job) => job.name.toLowerCase(),
  state: (job) => job.state,
  progress: fractionDone,
  error: (job) => job.error?.relMse ?? Infinity,
  eta: (job) => (job.etaSeconds < 0 ? Infinity : job.etaSeconds),
  owner: (job) => job.owner.toLowerCase(),
  method: (job) => job.method,
  priority: (job) => job.priority,
};

function matches(job: Job, words: readonly string[]): boolean {
  const text = `#${job.id} ${job.name} ${job.owner} ${job.host} ${methodName(job)} ${stateName(job.state)}`.toLowerCase();
  return words.every((word) => text.includes(word));
}

/** The jobs that match the query, in its order. Among equals newer jobs come first. */
export function listedJobs(list: JobList, query: JobQuery): Job[] {
  const words = query.search.toLowerCase().split(/\s+/).filter(Boolean);
  const key = kOrders[query.order];
  const sign = query.descending ? -1 : 1;
  return [...list.values()]
    .filter((job) => kFilters[query.filter](job) && matches(job, words))
    .sort((a, b) => {
      const [x, y] = [key(a), key(b)];
      return x === y ? Number(b.id - a.id) : x < y ? -sign : sign;
    });
}

/** The number of jobs that each filter would show. */
export function filterCounts(list: JobList): Record<JobFilter, number> {
  const counts = {all: 0, active: 0, done: 0, failed: 0};
  for (const job of list.values()) {
    for (const filter of Object.keys(counts) as JobFilter[]) {
      counts[filter] += kFilters[filter](job) ? 1 : 0;
    }
  }
  return counts;
}
