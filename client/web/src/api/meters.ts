/** Readings of the virtual meters in a job's scene. */
import {fromJson, type JsonValue} from '@bufbuild/protobuf';
import {MeterReadingsSchema, type MeterReading} from '../wire/lightmill/v1/web_pb';
import {ask} from './actions';

/** In the scene's order. Empty without meters, or if the job's method reads none. */
export async function fetchReadings(id: bigint, signal: AbortSignal): Promise<MeterReading[]> {
  return fromJson(MeterReadingsSchema, (await ask(`jobs/${id}/meters`, {signal})) as JsonValue, {ignoreUnknownFields: true}).readings;
}
