/** The list of the farm's events, of one kind. */
import type {FarmEvent, FarmEvents} from '../wire/lightmill/v1/web_pb';

export const kEventKinds = ['all', 'warnings', 'jobs', 'workers'] as const;
export type EventKind = (typeof kEventKinds)[number];

/** The coordinator keeps no more. */
const kMost = 5_000;

/** The known events. */
export interface EventBook {
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
export function withNewest(book: EventBook, page: FarmEvents): EventBook {
  if (!joins(book.events, page.events)) {
    return {events: page.events, older: page.nextPageToken};
  }
  const fresh = page.events.filter(({number}) => number > book.events[0]!.number);
  const events = [...fresh, ...book.events];
  return events.length > kMost ? {events: events.slice(0, kMost), older: ''} : {events, older: book.older};
}

/** Adds the page of `book.older`, if the list still ends there. */
export function withOlder(book: EventBook, token: string, page: FarmEvents): EventBook {
  return book.older === token ? {events: [...book.events, ...page.events], older: page.nextPageToken} : book;
}
