/** What the page asks the coordinator to do: the JSON API. Each call ends once the change is stored. */

export class ActionError extends Error {}

/** `path` begins behind api/v1/. */
export async function post(path: string, body: Record<string, unknown> = {}): Promise<void> {
  let response: Response;
  try {
    response = await fetch(`api/v1/${path}`, {
      method: 'POST',
      headers: {'Content-Type': 'application/json'},
      body: JSON.stringify(body),
    });
  } catch {
    throw new ActionError('the coordinator cannot be reached');
  }
  if (!response.ok) {
    const answer = (await response.json().catch(() => undefined)) as {error?: {message?: string}} | undefined;
    throw new ActionError(answer?.error?.message ?? `the coordinator answered ${response.status}`);
  }
}

export type JobAction = 'pause' | 'resume' | 'cancel';

export function actOnJob(job: bigint, action: JobAction): Promise<void> {
  return post(`jobs/${job}/${action}`);
}

/** Gives a job another goal: a new total of samples per pixel, or a relMSE; what is left out stays. */
export function extendJob(job: bigint, to: {samples?: number; error?: number}): Promise<void> {
  return post(`jobs/${job}/extend`, to);
}

export function drainWorker(name: string): Promise<void> {
  return post(`workers/${encodeURIComponent(name)}/drain`);
}

/** Lets a worker in quarantine, and those on its machine, render again. */
export function releaseWorker(name: string): Promise<void> {
  return post(`workers/${encodeURIComponent(name)}/release`);
}

/** The address of a job's thumbnail; another one once it has other pixels. */
export function thumbnailAddress(job: bigint, version: string): string {
  return `api/v1/jobs/${job}/thumbnail.png?v=${version}`;
}
