import {create} from '@bufbuild/protobuf';
import {expect, test} from 'vitest';
import {isSilent, kSilenceMs, retryDelayMs} from '../src/model/connection';
import {errorCurve} from '../src/model/error_curve';
import {ageText, boundedErrorText, clockTick, counted, errorText, goalText, humanCount, humanRate, humanSeconds, momentText, powerOfTen, samplesText, tickText, valueText} from '../src/model/format';
import {kMaxCharted, kPlainDisplay, parseRoute, routeHash, type JobView, type Route} from '../src/model/route';
import {JobSchema} from '../src/wire/lightmill/v1/farm_pb';

const kPlainView: JobView = {display: kPlainDisplay, camera: undefined, against: undefined, region: undefined, charted: [], layer: undefined, relight: new Map(), photons: 'none', meters: true};

test('times and numbers are written as the command line writes them', () => {
  expect([0.42, 12.3, 185, 7380, 4 * 86400 + 3 * 3600, -1].map(humanSeconds)).toEqual(['0.4 s', '12 s', '3 min 05 s', '2 h 03 min', '4 d 03 h', '?']);
  expect([950, 1234, 45.6e6, 12.34].map(humanCount)).toEqual(['950', '1.23 k', '45.6 M', '12.3']);
  expect([0, 0.5, 20, 100, 2.5e6, 3e6, 20e3].map(tickText)).toEqual(['0', '0.5', '20', '100', '2.5 M', '3 M', '20 k']);
  expect([0, 1, 2, 1234].map((number) => counted(number, 'result'))).toEqual(['0 results', '1 result', '2 results', '1.23 k results']);
  expect([950, 45.6e6].map(humanRate)).toEqual(['950 samples/s', '45.6 Msamples/s']);
  expect([0.01, 0.0001, 0.00001764, 9.92e-7, undefined, 4].map(errorText)).toEqual(['±10%', '±1.0%', '±0.42%', '±0.10%', '', '±200%']);
  expect(boundedErrorText({relMse: 0.0001, halfWidth: 0.000044})).toBe('±1.0% (95%: at most ±1.2%)');
  expect(boundedErrorText(undefined)).toBe('');
  expect([0, 0.5, 1e-5, 123456].map(valueText)).toEqual(['0.000', '0.5000', '1.000e-5', '1.235e+5']);
  expect([1, 0.1, 1e-3, 1e-4, 1e5, 1e6, 2, 0, null].map(powerOfTen)).toEqual(['1', '0.1', '0.001', '0.0001', '100000', '1e6', '', '', '']);
  expect(ageText(0, 1000)).toBe('');
  expect(ageText(1000, 1000 + 125_000)).toBe('2 min ago');
});

test("a goal's text names its limits", () => {
  const job = create(JobSchema, {goal: {samples: 64n, seconds: 90, error: 0.01}, frameSamples: 12n});
  expect(goalText(job)).toBe('64 samples or ±10% or 1 min 30 s');
  expect(goalText(create(JobSchema, {goal: {samples: 1n}}))).toBe('1 sample');
  expect(samplesText(job)).toBe('12/64');
  expect(samplesText(create(JobSchema, {frameSamples: 12n}))).toBe('12');
});

test('a link restores the view', () => {
  const route: Route = {
    page: 'job',
    job: 12n,
    display: {exposure: -1.5, gamma: 2.2, view: 'filmic', show: 'error'},
    camera: {zoom: 2.5, center: {x: 100.25, y: 40}},
    against: {other: 9n, how: 'difference', split: 0.25},
    region: {x: 3, y: 0, width: 20, height: 1},
    charted: [4n, 18446744073709551n],
    layer: 'light:key',
    relight: new Map([['light:key', {stops: -1.25, tint: [1, 1, 1]}]]),
    photons: 'few',
    meters: false,
  };
  expect(parseRoute(routeHash(route))).toEqual(route);
  const plain: Route = {page: 'job', job: 3n, ...kPlainView};
  expect(routeHash(plain)).toBe('#/jobs/3');
  expect(parseRoute('#/jobs/3')).toEqual(plain);
  for (const layer of ['', 'denoised', 'light:rest']) {
    const chosen: Route = {...plain, layer};
    expect(parseRoute(routeHash(chosen))).toEqual(chosen);
  }
  expect(routeHash({...plain, layer: ''})).toBe('#/jobs/3?layer=beauty');
  for (const page of ['jobs', 'workers', 'lab'] as const) {
    expect(parseRoute(routeHash({page}))).toEqual({page});
  }
});

test('every address leads to a page', () => {
  for (const hash of ['', '#', '#/', '#/jobs']) {
    expect(parseRoute(hash)).toEqual({page: 'jobs'});
  }
  for (const hash of ['#/jobs/x', '#/jobs/99999999999999999999', '#/jobs/-1', '#%', '#/nope']) {
    expect(parseRoute(hash)).toEqual({page: 'nowhere', path: hash.slice(1)});
    expect(routeHash(parseRoute(hash))).toBe(hash);
  }
  expect(parseRoute('#/jobs/1?exposure=x&gamma=-4&view=odd&show=odd&zoom=1')).toEqual({
    page: 'job',
    job: 1n,
    ...kPlainView,
    display: {...kPlainDisplay, gamma: 0.1},
  });
  const odd = parseRoute('#/jobs/1?with=file&how=odd&split=7&region=1,2,0,4&chart=3,x,3,-4,' + '5,6,7,8,9,10,11');
  expect(odd).toMatchObject({against: {other: 'file', how: 'split', split: 1}, region: undefined, charted: [3n, 5n, 6n, 7n, 8n, 9n, 10n]});
  expect(kMaxCharted).toBe(7);
  expect(parseRoute('#/jobs/1?with=x&region=1,2,3')).toMatchObject({against: undefined, region: undefined});
  expect(parseRoute('#/jobs/1?exposure=1e999')).toMatchObject({display: {exposure: 0}});
});

test('the delay before a new connection grows with each try, within bounds', () => {
  expect(retryDelayMs(1, 0.5)).toBe(500);
  expect(retryDelayMs(2, 0.5)).toBe(1000);
  expect(retryDelayMs(1000, 0.99)).toBeLessThan(12_500);
  expect(retryDelayMs(1, 0)).toBeGreaterThan(300);
});

test('a silent connection counts as lost, except on a hidden page', () => {
  expect(isSilent(0, kSilenceMs, false)).toBe(false);
  expect(isSilent(0, kSilenceMs + 1, false)).toBe(true);
  expect(isSilent(0, 10 * kSilenceMs, true)).toBe(false);
});

test('the error curve is extrapolated to its target as 1/seconds', () => {
  const job = create(JobSchema, {
    goal: {error: 0.01},
    workerSeconds: 40,
    error: {relMse: 0.02, halfWidth: 0.02},
    history: [
      {workerSeconds: 10, error: {relMse: 0.08, halfWidth: 0.01}},
      {workerSeconds: 20, error: {relMse: 0.04, halfWidth: 0.01}},
    ],
  });
  const curve = errorCurve(job);
  expect(curve.points.map((point) => point.seconds)).toEqual([10, 20, 40]);
  expect(curve.points[1]).toEqual({seconds: 20, error: 0.04, low: 0.03, high: 0.05});
  expect(curve.points[2]!.low).toBeGreaterThan(0);
  expect(curve.finish!.seconds).toBeCloseTo(160, 9);
  // The error is between 0 and 0.04 now. At the end, the upper end of the stated interval is the target.
  expect([curve.finish!.earliest, curve.finish!.latest]).toEqual([80, 240]);
  expect(curve.guides[0]!.to.error).toBeCloseTo((0.08 * 10) / 240, 9);
});

test('a finished or unknown curve has no extrapolation', () => {
  expect(errorCurve(create(JobSchema, {})).points).toEqual([]);
  const done = create(JobSchema, {goal: {error: 0.1}, workerSeconds: 5, error: {relMse: 0.05, halfWidth: 0.01}});
  expect(errorCurve(done).finish).toBeUndefined();
});

test('moments have the local time, and the day if it is another', () => {
  const ms = (day: number, hour: number, minute = 0, second = 0) => new Date(2026, 10, day, hour, minute, second).getTime();
  expect(clockTick(ms(23, 9, 5) / 1000)).toBe('09:05');
  expect(clockTick(ms(23, 0, 30) / 1000)).toBe('00:30');
  expect(clockTick(ms(24, 0) / 1000)).toBe('24 Nov');
  expect(momentText(ms(23, 9, 5, 7), ms(23, 23, 59))).toBe('09:05:07');
  expect(momentText(ms(23, 0), ms(23, 1))).toBe('00:00:00');
  expect(momentText(ms(22, 23, 59, 59), ms(23, 0))).toBe('22 Nov 23:59:59');
});
