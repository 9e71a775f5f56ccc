/** Jobs that the page submits: what others were asked for, new ones, and small ones that only live while something is edited. */
import {fromJson, toJson, type JsonValue} from '@bufbuild/protobuf';
import {JobSchema, JobSpecSchema, type JobSpec} from '../wire/lightmill/v1/farm_pb';
import {hexOf} from '../model/bytes';
import {ActionError, ask, post} from './actions';
import {kPage} from './live';

/** With its packed scene. */
export async function fetchSpec(job: bigint): Promise<JobSpec> {
  return fromJson(JobSpecSchema, (await ask(`jobs/${job}/spec`)) as JsonValue, {ignoreUnknownFields: true});
}

/** Submits jobs, each once: the same again, after an answer that did not come, is the same job. */
export class Submitter {
  private last: {job: string; requestId: string} | undefined;

  /** `withPage`: the job is deleted when this page is gone, however it goes. */
  constructor(private readonly withPage = false) {}

  /** Its number, once it is stored. */
  async submit(spec: JobSpec): Promise<bigint> {
    const job = toJson(JobSpecSchema, spec, {useProtoFieldName: true});
    const text = JSON.stringify(job);
    if (this.last?.job !== text) {
      this.last = {job: text, requestId: hexOf(crypto.getRandomValues(new Uint8Array(16)))};
    }
    const answer = await post(this.withPage ? `jobs?page=${kPage}` : 'jobs', {request_id: this.last.requestId, job});
    const {id} = fromJson(JobSchema, answer as JsonValue, {ignoreUnknownFields: true});
    this.last = undefined; // not before its answer was understood
    return id;
  }
}

/** Ends and forgets a job, whatever state it is in; one that is not there is forgotten. */
export async function discardJob(job: bigint): Promise<void> {
  try {
    await post(`jobs/${job}/delete`, {cancel: true});
  } catch (error) {
    if (!(error instanceof ActionError && error.status === 404)) {
      throw error;
    }
  }
}
