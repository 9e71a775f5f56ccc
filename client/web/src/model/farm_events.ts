/** The list of the farm's events, of one kind, or of the actions in its log. */
import {create} from '@bufbuild/protobuf';
import type {Action, ListActionsResponse} from '../wire/lightmill/v1/access_service_pb';
import {FarmEventsSchema, type FarmEvent, type FarmEvents} from '../wire/lightmill/v1/web_pb';

export const kEventKinds = ['all', 'warnings', 'jobs', 'workers', 'actions'] as const;
export type EventKind = (typeof kEventKinds)[number];

/** "ada: SetPriority cornell: priority 0 -> 10". Actions of the coordinator and of unknown callers have no name. */
export function actionText({caller, operation, about, code, message, change}: Action): string {
  const outcome = code === 0 ? change : `refused: ${message}`;
  return [caller, about === '' ? operation : `${operation} ${about}`, outcome].filter((part) => part !== '').join(': ');
}

/** Actions in the form of events. Refusals are warnings. */
export function eventsOfActions({actions, nextPageToken}: ListActionsResponse): FarmEvents {
  const events = actions.map((action) => ({number: action.number, unixMs: action.unixMs, job: action.job, warning: action.code !== 0, text: actionText(action)}));
  return create(FarmEventsSchema, {events, nextPageToken});
}

/** Limit of the list. The coordinator keeps this number of events, and more actions. */
const kMax = 5_000;

/** The known events. */
export interface EventPages {
  /** Newest first, without gaps. */
  events: readonly FarmEvent[];
  /** The token of the page before them; empty if there is none. */
  older: string;
}

/** Whether the pages join without a gap, and are of one coordinator. A restarted coordinator counts from 1. */
function joins(known: readonly FarmEvent[], coming: readonly FarmEvent[]): boolean {
  const newest = known[0];
  return coming.some(({number, unixMs}) => number === newest?.number && unixMs === newest.unixMs);
}

/** Adds the newest page. It replaces all if it does not join them. */
export function withNewest(pages: EventPages, page: FarmEvents): EventPages {
  if (!joins(pages.events, page.events)) {
    return {events: page.events, older: page.nextPageToken};
  }
  const fresh = page.events.filter(({number}) => number > pages.events[0]!.number);
  const events = [...fresh, ...pages.events];
  return events.length > kMax ? {events: events.slice(0, kMax), older: ''} : {events, older: pages.older};
}

/** Adds the page of `pages.older`, if the list still ends there. */
export function withOlder(pages: EventPages, token: string, page: FarmEvents): EventPages {
  return pages.older === token ? {events: [...pages.events, ...page.events], older: page.nextPageToken} : pages;
}
