import {expect, test} from 'vitest';
import {LivePicture} from '../src/model/live_picture';

/** A farm that answers when the test says so, and records the most jobs that it had at once. */
class Jobs {
  next = 1n;
  readonly there = new Map<bigint, string>();
  most = 0;
  readonly asked: string[] = [];
  /** Discards that fail. */
  broken = 0;
  private readonly waiting: (() => void)[] = [];

  private answer(): Promise<void> {
    return new Promise((resolve) => this.waiting.push(resolve));
  }
  async submit(request: string): Promise<bigint> {
    this.asked.push(request);
    await this.answer();
    if (request.startsWith('bad')) {
      throw new Error(`${request} is refused`);
    }
    const job = this.next++;
    this.there.set(job, request);
    this.most = Math.max(this.most, this.there.size);
    return job;
  }
  async discard(job: bigint): Promise<void> {
    await this.answer();
    if (this.broken > 0) {
      --this.broken;
      throw new Error('too much to do');
    }
    this.there.delete(job);
  }
  /** Answers all requests, until none is left. */
  async settle(): Promise<void> {
    for (let quiet = 0; quiet < 20; ++quiet) {
      await Promise.resolve();
      const answer = this.waiting.shift();
      if (answer) {
        answer();
        quiet = 0;
      }
    }
  }
}

function looking() {
  const jobs = new Jobs();
  const shown: (bigint | undefined)[] = [];
  const failures: string[] = [];
  const picture = new LivePicture<string>(jobs, {onJob: (job) => shown.push(job), onFailure: (message) => failures.push(message)});
  return {jobs, shown, failures, picture};
}

test('there is one live picture at most, of the newest edit', async () => {
  const {jobs, shown, picture} = looking();
  for (const request of ['a', 'b', 'c']) {
    picture.want(request);
  }
  await jobs.settle();
  expect(jobs.asked).toEqual(['c']);
  picture.want('d');
  await Promise.resolve();
  picture.want('e');
  picture.want('f');
  await jobs.settle();
  expect([...jobs.there.values()]).toEqual(['f']);
  expect(jobs.most).toBe(1);
  expect(jobs.asked.length).toBeLessThanOrEqual(3);
  expect(shown.at(-1)).toBe(picture.current);
});

test('no job outlives the panel', async () => {
  const {jobs, picture} = looking();
  picture.want('a');
  await jobs.settle();
  picture.want('b');
  const closed = picture.close();
  picture.want('too late');
  await jobs.settle();
  await closed;
  expect(jobs.there.size).toBe(0);
  expect(jobs.asked).not.toContain('too late');
});

test('a refused edit is reported, and the next one is rendered', async () => {
  const {jobs, failures, picture} = looking();
  picture.want('bad');
  await jobs.settle();
  expect(failures).toEqual(['bad is refused']);
  picture.want('good');
  await jobs.settle();
  expect(failures.at(-1)).toBe('');
  expect([...jobs.there.values()]).toEqual(['good']);
});

test('a discard that fails delays no edit, and is repeated with the next one', async () => {
  const {jobs, picture, failures} = looking();
  picture.want('a');
  await jobs.settle();
  jobs.broken = 1;
  picture.want('b');
  await jobs.settle();
  expect([...jobs.there.values()]).toEqual(['a', 'b']);
  expect(failures.at(-1)).toBe('');
  picture.want('c');
  await jobs.settle();
  expect([...jobs.there.values()]).toEqual(['c']);
});

test("a forgotten job is not discarded, because its number is another farm's", async () => {
  const {jobs, picture} = looking();
  picture.want('a');
  await jobs.settle();
  picture.forget();
  picture.want('b');
  await jobs.settle();
  expect([...jobs.there.values()]).toEqual(['a', 'b']);
  expect(picture.current).toBe(2n);
});
