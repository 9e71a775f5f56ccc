/** Jobs that the page submits: what others were asked for, new ones, and small ones that only live while something is edited. */
import {fromJson, toJson, type JsonValue} from '@bufbuild/protobuf';
import {JobSchema, JobSpecSchema, type JobSpec} from '../wire/lightmill/v1/farm_pb';
import {hexOf} from '../model/bytes';
import {actOnJob, ask, deleteJob, post} from './actions';

/** With its packed scene. */
export async function fetchSpec(job: bigint): Promise<JobSpec> {
  return fromJson(JobSpecSchema, (await ask(`jobs/${job}/spec`)) as JsonValue, {ignoreUnknownFields: true});
}

/** Its number, once it is stored. */
export async function submitJob(spec: JobSpec): Promise<bigint> {
  const requestId = hexOf(crypto.getRandomValues(new Uint8Array(16)));
  const answer = await post('jobs', {request_id: requestId, job: toJson(JobSpecSchema, spec, {useProtoFieldName: true})});
  return fromJson(JobSchema, answer as JsonValue, {ignoreUnknownFields: true}).id;
}

/** Ends and forgets a job, whatever state it is in. */
export async function discardJob(job: bigint): Promise<void> {
  // One that has ended cannot be cancelled, and is deleted all the same.
  await actOnJob(job, 'cancel').catch(() => undefined);
  await deleteJob(job);
}

/** The same while the page is being closed: nobody waits for the answers. */
export function discardAtOnce(job: bigint): void {
  for (const action of ['cancel', 'delete']) {
    void post(`jobs/${job}/${action}`, {}, {keepalive: true}).catch(() => undefined);
  }
}
