/** Jobs that the page submits: clones, new jobs, and those of live pictures, which exist only during editing. */
import {fromJson, toJson, type JsonValue} from '@bufbuild/protobuf';
import {JobSchema, JobSpecSchema, type JobSpec} from '../wire/lightmill/v1/farm_pb';
import {hexOf} from '../model/bytes';
import {ActionError, ask, post} from './actions';
import {kPage} from './live';

/** Includes the packed scene. */
export async function fetchSpec(job: bigint): Promise<JobSpec> {
  return fromJson(JobSpecSchema, (await ask(`jobs/${job}/spec`)) as JsonValue, {ignoreUnknownFields: true});
}

/** Submits jobs, each once. A retry after a lost answer gives the same job. */
export class Submitter {
  private last: {job: string; requestId: string} | undefined;

  /** `withPage`: the coordinator deletes the job when this page is gone. */
  constructor(private readonly withPage = false) {}

  /** Returns the job's number once it is stored. */
  async submit(spec: JobSpec): Promise<bigint> {
    const job = toJson(JobSpecSchema, spec, {useProtoFieldName: true});
    const text = JSON.stringify(job);
    if (this.last?.job !== text) {
      this.last = {job: text, requestId: hexOf(crypto.getRandomValues(new Uint8Array(16)))};
    }
    const answer = await post(this.withPage ? `jobs?page=${kPage}` : 'jobs', {request_id: this.last.requestId, job});
    const {id} = fromJson(JobSchema, answer as JsonValue, {ignoreUnknownFields: true});
    this.last = undefined; // kept until the answer is understood
    return id;
  }
}

/** Cancels and deletes a job in any state. A missing job is no error. */
export async function discardJob(job: bigint): Promise<void> {
  try {
    await post(`jobs/${job}/delete`, {cancel: true});
  } catch (error) {
    if (!(error instanceof ActionError && error.status === 404)) {
      throw error;
    }
  }
}
