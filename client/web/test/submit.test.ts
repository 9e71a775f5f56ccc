import {create} from '@bufbuild/protobuf';
import {afterEach, expect, test, vi} from 'vitest';
import {Submitter} from '../src/api/submit';
import {JobSpecSchema} from '../src/wire/lightmill/v1/farm_pb';

/** Answers one request after the other, and records them. */
function answering(...answers: (() => Response | Promise<Response>)[]): string[] {
  const asked: string[] = [];
  vi.stubGlobal('fetch', async (_: string, {body}: RequestInit) => {
    asked.push((JSON.parse(String(body)) as {request_id: string}).request_id);
    return answers[asked.length - 1]!();
  });
  return asked;
}

const stored = (id: number) => () => new Response(JSON.stringify({id: String(id)}));
const box = create(JobSpecSchema, {name: 'box'});

afterEach(() => {
  vi.unstubAllGlobals();
});

test('a job whose answer was lost is submitted again under the same request ID', async () => {
  const asked = answering(
    () => Promise.reject(new TypeError('no connection')),
    () => new Response('{"id": "7'),
    stored(7),
    stored(8),
  );
  const submitter = new Submitter();
  await expect(submitter.submit(box)).rejects.toThrow('cannot be reached');
  await expect(submitter.submit(box)).rejects.toThrow();
  expect(await submitter.submit(box)).toBe(7n);
  expect(await submitter.submit(box)).toBe(8n);
  expect(asked[0]).toMatch(/^[0-9a-f]{32}$/);
  expect(asked[1]).toBe(asked[0]);
  expect(asked[2]).toBe(asked[0]);
  expect(asked[3]).not.toBe(asked[0]);
});

test('another job has another request ID', async () => {
  const asked = answering(() => Promise.reject(new TypeError('no connection')), stored(1));
  const submitter = new Submitter();
  await expect(submitter.submit(box)).rejects.toThrow();
  expect(await submitter.submit(create(JobSpecSchema, {name: 'balls'}))).toBe(1n);
  expect(asked[1]).not.toBe(asked[0]);
});

test('jobs that end with the page carry the same page ID', async () => {
  const paths: string[] = [];
  vi.stubGlobal('fetch', async (path: string) => {
    paths.push(path);
    return stored(paths.length)();
  });
  await new Submitter(true).submit(box);
  await new Submitter(true).submit(box);
  await new Submitter().submit(box);
  expect(paths[0]).toMatch(/^api\/v1\/jobs\?page=[0-9a-f]{32}$/);
  expect(paths[1]).toBe(paths[0]);
  expect(paths[2]).toBe('api/v1/jobs');
});
