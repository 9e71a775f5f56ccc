import {create} from '@bufbuild/protobuf';
import {expect, test} from 'vitest';
import {emptyText, filterCounts, fractionDone, kNewestFirst, listedJobs, withJobs, withWorkers, type JobList} from '../src/model/jobs';
import {healthOf} from '../src/model/workers';
import {JobSchema, JobState, WorkerSchema, type Job} from '../src/wire/lightmill/v1/farm_pb';
import {JobChangesSchema, WorkerChangesSchema} from '../src/wire/lightmill/v1/web_pb';

function job(id: number, more: Partial<Omit<Job, '$typeName' | '$unknown'>> = {}): Job {
  return create(JobSchema, {id: BigInt(id), name: `scene ${id}`, state: JobState.RUNNING, etaSeconds: -1, ...more} as object);
}
const list = (...jobs: Job[]): JobList => new Map(jobs.map((each) => [each.id, each]));
const ids = (jobs: Job[]) => jobs.map((each) => Number(each.id));

test('changes add, replace and remove jobs in a new list', () => {
  const before = list(job(1), job(2));
  const after = withJobs(before, create(JobChangesSchema, {jobs: [job(2, {name: 'other'}), job(3)], removed: [1n]}));
  expect([...after.keys()]).toEqual([2n, 3n]);
  expect(after.get(2n)?.name).toBe('other');
  expect([...before.keys()]).toEqual([1n, 2n]);
});

test('a whole list replaces the one before', () => {
  const after = withJobs(list(job(1)), create(JobChangesSchema, {whole: true, jobs: [job(5)]}));
  expect([...after.keys()]).toEqual([5n]);
  const worker = create(WorkerSchema, {name: 'w'});
  expect([...withWorkers(new Map([['old', worker]]), create(WorkerChangesSchema, {whole: true, workers: [worker]})).keys()]).toEqual(['w']);
});

test('a search finds the jobs that have each word in one of their texts', () => {
  const jobs = list(job(1, {owner: 'Ada', method: 'path'}), job(2, {owner: 'bob', method: 'caustic', state: JobState.DONE}));
  const search = (text: string) => ids(listedJobs(jobs, {...kNewestFirst, search: text}));
  expect(search('ada')).toEqual([1]);
  expect(search('bob caustic done')).toEqual([2]);
  expect(search('bob path')).toEqual([]);
  expect(search('#2')).toEqual([2]);
  expect(search('')).toEqual([2, 1]);
});

test('each filter shows the jobs that it counts', () => {
  const jobs = list(job(1), job(2, {state: JobState.DONE}), job(3, {state: JobState.CANCELLED}), job(4, {state: JobState.PAUSED}));
  expect(filterCounts(jobs)).toEqual({all: 4, active: 2, done: 1, failed: 1});
  expect(ids(listedJobs(jobs, {...kNewestFirst, filter: 'active'}))).toEqual([4, 1]);
});

test('unknown times come last in ascending order, and newer jobs first among equals', () => {
  const jobs = list(
    job(1, {etaSeconds: 50}),
    job(2),
    job(3, {etaSeconds: 10}),
    job(4),
  );
  expect(ids(listedJobs(jobs, {...kNewestFirst, order: 'eta', descending: false}))).toEqual([3, 1, 4, 2]);
});

test('progress follows the nearest limit, and a met error is not yet the end', () => {
  const goal = (samples: bigint, seconds: number, error: number) => ({$typeName: 'lightmill.v1.Goal' as const, samples, seconds, error, adaptive: false});
  expect(fractionDone(job(1, {goal: goal(8n, 0, 0), samplesDone: 25n, samplesWanted: 100n}))).toBe(0.25);
  expect(fractionDone(job(1, {goal: goal(8n, 10, 0), samplesDone: 25n, samplesWanted: 100n, activeSeconds: 5}))).toBe(0.5);
  const error = {$typeName: 'lightmill.v1.ErrorEstimate' as const, relMse: 0.03, halfWidth: 0.01};
  expect(fractionDone(job(1, {goal: goal(0n, 0, 0.01), error}))).toBe(0.25);
  expect(fractionDone(job(1, {goal: goal(0n, 0, 1), error}))).toBe(0.99);
  expect(fractionDone(job(1, {state: JobState.DONE}))).toBe(1);
});

test('a quarantined worker is not listed as idle', () => {
  const health = (more: object) => healthOf(create(WorkerSchema, {name: 'w', ...more})).name;
  expect(health({})).toBe('idle');
  expect(health({leases: 1})).toBe('rendering');
  expect(health({draining: true, leases: 1})).toBe('draining');
  expect(health({quarantine: 'wrong', draining: true})).toBe('quarantine');
  expect(health({quarantine: 'wrong', away: true})).toBe('quarantine, away');
});

test('a picture without pixels shows the reason', () => {
  expect(emptyText(undefined)).toBe('Loading…');
  expect(emptyText(job(1, {samplesDone: 5n}))).toBe('Loading…');
  expect(emptyText(job(1))).toBe('No samples yet.');
  expect(emptyText(job(1, {state: JobState.CANCELLED}))).toBe('This job has no picture: it ended before its first sample.');
});
