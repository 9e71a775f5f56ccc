/** The JSON API: actions that the page requests of the coordinator. Each call returns once the change is stored. */

import {inPageWords} from '../model/page_words';

export class ActionError extends Error {
  constructor(
    message: string,
    /** The HTTP status; 0 if there was no answer. */
    readonly status = 0,
  ) {
    super(message);
  }
}

/** Returns the coordinator's answer. `path` is relative to api/v1/. */
export async function ask(path: string, init?: RequestInit): Promise<unknown> {
  let response: Response;
  try {
    response = await fetch(`api/v1/${path}`, init);
  } catch (error) {
    throw error instanceof DOMException && error.name === 'AbortError' ? error : new ActionError('the coordinator cannot be reached');
  }
  const answer = (await response.json().catch(() => undefined)) as {error?: {message?: string}} | undefined;
  if (!response.ok) {
    const message = answer?.error?.message;
    throw new ActionError(message ? inPageWords(message) : `the coordinator answered ${response.status}`, response.status);
  }
  return answer;
}

export function post(path: string, body: unknown = {}, more: Pick<RequestInit, 'signal'> = {}): Promise<unknown> {
  return ask(path, {method: 'POST', headers: {'Content-Type': 'application/json'}, body: JSON.stringify(body), ...more});
}

export type JobAction = 'pause' | 'resume' | 'cancel';

export async function actOnJob(job: bigint, action: JobAction): Promise<void> {
  await post(`jobs/${job}/${action}`);
}

/** Deletes an ended job and its picture. */
export async function deleteJob(job: bigint): Promise<void> {
  await post(`jobs/${job}/delete`);
}

export async function setPriority(job: bigint, priority: number): Promise<void> {
  await post(`jobs/${job}/priority`, {priority});
}

/** Changes a job's goal: a new total of samples per pixel, or a relMSE. What is left out stays. */
export async function extendJob(job: bigint, to: {samples?: number; error?: number}): Promise<void> {
  await post(`jobs/${job}/extend`, to);
}

export async function drainWorker(name: string): Promise<void> {
  await post(`workers/${encodeURIComponent(name)}/drain`);
}

/** Quarantines a worker and all others of its identity, until they are released. */
export async function quarantineWorker(name: string): Promise<void> {
  await post(`workers/${encodeURIComponent(name)}/quarantine`);
}

/** Releases a worker, and those of its identity, from quarantine. */
export async function releaseWorker(name: string): Promise<void> {
  await post(`workers/${encodeURIComponent(name)}/release`);
}

/** The address of a job's thumbnail. It changes with `version`. */
export function thumbnailAddress(job: bigint, version: string): string {
  return `api/v1/jobs/${job}/thumbnail.png?v=${version}`;
}
