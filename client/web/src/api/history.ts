/** A job with its history, fetched once, for charts of jobs that are not watched. */
import {fromJson, type JsonValue} from '@bufbuild/protobuf';
import {JobSchema, type Job} from '../wire/lightmill/v1/farm_pb';
import {ask} from './actions';

export async function fetchJob(id: bigint): Promise<Job> {
  return fromJson(JobSchema, (await ask(`jobs/${id}`)) as JsonValue, {ignoreUnknownFields: true});
}
