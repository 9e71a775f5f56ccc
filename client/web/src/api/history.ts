/** A job with its history, asked for once: for charts of jobs that are not looked at. */
import {fromJson, type JsonValue} from '@bufbuild/protobuf';
import {JobSchema, type Job} from '../wire/lightmill/v1/farm_pb';
import {ActionError} from './actions';

export async function fetchJob(id: bigint): Promise<Job> {
  const response = await fetch(`api/v1/jobs/${id}`);
  if (!response.ok) {
    const answer = (await response.json().catch(() => undefined)) as {error?: {message?: string}} | undefined;
    throw new ActionError(answer?.error?.message ?? `the coordinator answered ${response.status}`);
  }
  return fromJson(JobSchema, (await response.json()) as JsonValue, {ignoreUnknownFields: true});
}
