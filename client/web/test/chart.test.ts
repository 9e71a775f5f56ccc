import {expect, test} from 'vitest';
import {csvOf, nearestPoint, type ChartLine} from '../src/model/chart';
import {parseLabReport} from '../src/model/lab_report';

const point = (seconds: number, error: number) => ({seconds, error, low: error / 2, high: error * 2});
const path: ChartLine = {name: 'a, "b" <c>', method: 'path', color: '#112233', points: [point(1, 0.1), point(10, 0.01), point(100, 0.001)]};
const other: ChartLine = {name: '=HYPERLINK(1)', method: 'vcm', color: '#445566', points: [point(2, 0.5)]};

test('the CSV has a line for each point, and none of its texts is a formula', () => {
  expect(csvOf([path, other]).split('\n')).toEqual([
    'name,method,thread_seconds,rel_mse,low,high',
    '"a, ""b"" <c>",path,1,0.1,0.05,0.2',
    '"a, ""b"" <c>",path,10,0.01,0.005,0.02',
    '"a, ""b"" <c>",path,100,0.001,0.0005,0.002',
    "'=HYPERLINK(1),vcm,2,0.5,0.25,1",
    '',
  ]);
});

test('the nearest point is measured on the logarithmic axis', () => {
  expect(nearestPoint(path.points, 3)?.seconds).toBe(1);
  expect(nearestPoint(path.points, 4)?.seconds).toBe(10);
  expect(nearestPoint([], 4)).toBeUndefined();
});

test('a lab report has a line for each method, without values of zero', () => {
  const curve = [
    {thread_seconds: 1, rel_mse: 0.1, rel_mse_least: 0.05, rel_mse_most: 0.2},
    {thread_seconds: 2, rel_mse: 0, rel_mse_least: 0, rel_mse_most: 0},
    {thread_seconds: 4, rel_mse: 0.02, rel_mse_least: 0, rel_mse_most: 0.03},
  ];
  const report = parseLabReport(JSON.stringify({title: 'boxes', wanted: 3, results: [], scenes: [{scene: 'box', reference: 'path', methods: [{method: 'vcm', curve}]}]}));
  expect(report.title).toBe('boxes');
  expect(report.scenes[0]!.lines[0]).toMatchObject({
    name: 'box',
    method: 'vcm',
    points: [
      {seconds: 1, error: 0.1, low: 0.05, high: 0.2},
      {seconds: 4, error: 0.02, low: 0.02, high: 0.03},
    ],
  });
});

test('a file that is not a lab report is refused with the reason', () => {
  expect(() => parseLabReport('nothing')).toThrow(/the file is not JSON/);
  expect(() => parseLabReport('[]')).toThrow(/the file is not an object: this is not the results.json/);
  expect(() => parseLabReport('{"scenes": [{"scene": "box"}]}')).toThrow(/scene box has no list "methods"/);
});
