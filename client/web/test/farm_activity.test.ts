import {create, type MessageInitShape} from '@bufbuild/protobuf';
import {expect, test} from 'vitest';
import {eventQuery} from '../src/api/farm_activity';
import {actionText, eventsOfActions, withNewest, withOlder} from '../src/model/farm_events';
import {csvOfHistory, farmWindow, lonely, seriesOf, utilisation, workerSeriesOf} from '../src/model/farm_history';
import {ActionSchema, ListActionsResponseSchema} from '../src/wire/lightmill/v1/access_service_pb';
import {FarmEventSchema, FarmEventsSchema, FarmHistorySchema, WorkerHistorySchema} from '../src/wire/lightmill/v1/web_pb';

const kHistory = create(FarmHistorySchema, {
  intervalSeconds: 10,
  samples: [
    {unixMs: 10_000n, seconds: 10, pixelSamples: 50, workers: 1, threads: 4, busyThreads: 4, jobsRunning: 1},
    {unixMs: 20_000n, seconds: 10, pixelSamples: 0, workers: 1, threads: 4, jobsWaiting: 2},
    {unixMs: 120_000n, seconds: 100, pixelSamples: 1000, workers: 2, threads: 8, busyThreads: 2},
  ],
});

test('a time without samples is a gap', () => {
  const series = seriesOf(kHistory);
  expect(series.times).toEqual([10, 20, 70, 120]);
  expect(series.rate).toEqual([5, 0, null, 10]);
  expect(series.threads).toEqual([4, 4, null, 8]);
  expect(series.busy).toEqual([4, 0, null, 2]);
  expect(series.running).toEqual([1, 0, null, 0]);
  expect(series.waiting).toEqual([0, 2, null, 0]);
});

test('a time in which the machine slept is a gap', () => {
  const samples = [10_000n, 20_000n, 3_600_000n, 3_610_000n].map((unixMs) => ({unixMs, seconds: 10, pixelSamples: 10}));
  const series = seriesOf(create(FarmHistorySchema, {intervalSeconds: 10, samples}));
  expect(series.times).toEqual([10, 20, 1810, 3600, 3610]);
  expect(series.rate).toEqual([1, 1, null, 1, 1]);
});

test('a value between two gaps is a point', () => {
  expect(lonely([1, null, 2, 3, null, 0, null])).toEqual([0, 5]);
  expect(lonely([4])).toEqual([0]);
  expect(lonely([null, 1, 2])).toEqual([]);
});

test('an axis ends now and begins with the first sample, within a least and a greatest length', () => {
  const at = (unixMs: bigint, seconds = 10) => create(FarmHistorySchema, {unixMs: 100_000_000n, intervalSeconds: 10, samples: [{unixMs, seconds}]});
  expect(farmWindow(at(99_995_000n), 3600)).toEqual([99_850, 100_000]);
  expect(farmWindow(at(98_000_000n), 3600)).toEqual([97_990, 100_000]);
  expect(farmWindow(at(90_000_000n), 3600)).toEqual([96_400, 100_000]);
});

test('utilisation is the busy share of thread time', () => {
  expect(utilisation(kHistory)).toBeCloseTo((100 * (40 + 200)) / (40 + 40 + 800));
  expect(utilisation(create(FarmHistorySchema, {}))).toBeUndefined();
});

test('the CSV has a line for each sample', () => {
  expect(csvOfHistory(kHistory).split('\n')).toEqual([
    'until,seconds,pixel_samples,workers,threads,busy_threads,units,jobs_running,jobs_waiting',
    '1970-01-01T00:00:10.000Z,10,50,1,4,4,0,1,0',
    '1970-01-01T00:00:20.000Z,10,0,1,4,0,0,0,2',
    '1970-01-01T00:02:00.000Z,100,1000,2,8,2,0,0,0',
    '',
  ]);
});

test("a worker's series has its speed, and a gap while it was away", () => {
  const series = workerSeriesOf(
    create(WorkerHistorySchema, {
      minutes: [
        {unixMs: 60_000n, seconds: 30, results: 3n, pixelSamples: 600},
        {unixMs: 120_000n},
        {unixMs: 180_000n, seconds: 60, results: 2n, leasesLost: 1n, pixelSamples: 60},
      ],
    }),
  );
  expect(series).toEqual({times: [60, 120, 180], rate: [20, null, 1], results: 5, lost: 1, seconds: 90, window: [-720, 180]});
});

const event = (number: number, more = {}) => create(FarmEventSchema, {number: BigInt(number), unixMs: BigInt(1000 * number), ...more});
const page = (numbers: number[], nextPageToken = '', more = {}) => create(FarmEventsSchema, {nextPageToken, events: numbers.map((each) => event(each, more))});
const kNothing = {events: [], older: ''};
const read = ({events, older}: {events: readonly {number: bigint}[]; older: string}) => [events.map((each) => Number(each.number)), older];

test('each event is listed once, newest first', () => {
  const known = withNewest(kNothing, page([4, 3], 'three'));
  expect(read(withNewest(known, page([6, 4, 3], 'three')))).toEqual([[6, 4, 3], 'three']);
  expect(read(withNewest(known, page([5, 4], 'four')))).toEqual([[5, 4, 3], 'three']);
  expect(read(withOlder(known, 'three', page([2, 1])))).toEqual([[4, 3, 2, 1], '']);
  expect(read(withNewest(kNothing, page([])))).toEqual([[], '']);
});

test('a newer page replaces the list if events may be missing between them', () => {
  const known = withNewest(kNothing, page([4, 3], 'three'));
  const later = withNewest(known, page([9, 8], 'eight'));
  expect(read(later)).toEqual([[9, 8], 'eight']);
  expect(read(withOlder(later, 'three', page([2, 1])))).toEqual([[9, 8], 'eight']);
});

test('the events of a restarted coordinator replace the list', () => {
  const known = withNewest(kNothing, page([40, 39], 'old'));
  expect(read(withNewest(known, page([2, 1])))).toEqual([[2, 1], '']);
  expect(read(withNewest(known, page([41, 40], 'new', {unixMs: 9n})))).toEqual([[41, 40], 'new']);
  expect(read(withNewest(known, page([])))).toEqual([[], '']);
});

test('the list has no more events than the coordinator keeps', () => {
  const known = {events: page(Array.from({length: 5000}, (_, i) => 5000 - i)).events, older: 'x'};
  const {events, older} = withNewest(known, page([5002, 5001, 5000], 'y'));
  expect([events.length, events[0]!.number, events.at(-1)!.number, older]).toEqual([5000, 5002n, 3n, '']);
});

test('a query encodes spaces and signs in names', () => {
  expect(eventQuery({kind: 'workers', worker: 'w 1+2&3', size: 50})).toBe('kind=workers&worker=w%201%2B2%263&page_size=50');
  expect(eventQuery({})).toBe('');
});

test("an action's text names the caller, the operation, its object and the change", () => {
  const text = (action: MessageInitShape<typeof ActionSchema>) => actionText(create(ActionSchema, action));
  expect(text({caller: 'ada', operation: 'SetPriority', about: 'cornell', change: 'priority 0 -> 10'})).toBe('ada: SetPriority cornell: priority 0 -> 10');
  expect(text({caller: 'ada', operation: 'PauseJob'})).toBe('ada: PauseJob');
  expect(text({operation: 'Start', about: 'epoch 1, process 7'})).toBe('Start epoch 1, process 7');
  expect(text({caller: 'eve', operation: 'CancelJob', code: 7, message: 'the job belongs to another user'})).toBe('eve: CancelJob: refused: the job belongs to another user');
});

test('actions are listed as events, and refusals as warnings', () => {
  const actions = [
    {number: 8n, unixMs: 2000n, operation: 'CancelJob', job: 3n, code: 7},
    {number: 5n, unixMs: 1000n, operation: 'Start'},
  ];
  const {events, nextPageToken} = eventsOfActions(create(ListActionsResponseSchema, {actions, nextPageToken: '5'}));
  expect(events.map(({number, unixMs, job, warning}) => [number, unixMs, job, warning])).toEqual([
    [8n, 2000n, 3n, true],
    [5n, 1000n, 0n, false],
  ]);
  expect(nextPageToken).toBe('5');
});
