/** The farm's history and events. They are polled while a page shows them. */
import {fromJson, type JsonValue} from '@bufbuild/protobuf';
import {eventsOfActions, type EventKind} from '../model/farm_events';
import {ListActionsResponseSchema} from '../wire/lightmill/v1/access_service_pb';
import {FarmEventsSchema, FarmHistorySchema, WorkerHistorySchema, type FarmEvents, type FarmHistory, type WorkerHistory} from '../wire/lightmill/v1/web_pb';
import {ask} from './actions';

const kLenient = {ignoreUnknownFields: true};

export async function fetchHistory(seconds: number, signal: AbortSignal): Promise<FarmHistory> {
  return fromJson(FarmHistorySchema, (await ask(`history?span=${seconds}`, {signal})) as JsonValue, kLenient);
}

export async function fetchWorkerHistory(name: string, signal: AbortSignal): Promise<WorkerHistory> {
  return fromJson(WorkerHistorySchema, (await ask(`workers/${encodeURIComponent(name)}/history`, {signal})) as JsonValue, kLenient);
}

export interface EventQuery {
  kind?: EventKind;
  worker?: string;
  /** The token of the next page. */
  token?: string;
  size?: number;
}

/** Encoded as in paths: a + stands for itself. */
export function eventQuery({kind, worker, token, size}: EventQuery): string {
  const given = Object.entries({kind, worker, page_token: token, page_size: size && String(size)}).filter(([, value]) => value);
  return given.map(([name, value]) => `${name}=${encodeURIComponent(value!)}`).join('&');
}

export async function fetchEvents({kind, worker, token, size}: EventQuery, signal?: AbortSignal): Promise<FarmEvents> {
  if (kind === 'actions') {
    return eventsOfActions(fromJson(ListActionsResponseSchema, (await ask(`actions?${eventQuery({token, size})}`, {signal})) as JsonValue, kLenient));
  }
  return fromJson(FarmEventsSchema, (await ask(`events?${eventQuery({kind, worker, token, size})}`, {signal})) as JsonValue, kLenient);
}
