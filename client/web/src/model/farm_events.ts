/** The farm's events as the page lists them, of one kind. */
import type {FarmEvent, FarmEvents} from '../wire/lightmill/v1/web_pb';

export const kEventKinds = ['all', 'warnings', 'jobs', 'workers'] as const;
export type EventKind = (typeof kEventKinds)[number];

/** The coordinator keeps no more. */
const kMost = 5_000;

/** What is known of them. */
export interface EventBook {
  /** Newest first, none left out. */
  events: readonly FarmEvent[];
  /** The token of those before them; empty: there are none. */
  older: string;
}

/** Whether nothing is missing between the two, and they are of one coordinator: one that begins anew counts from 1. */
function joins(known: readonly FarmEvent[], coming: readonly FarmEvent[]): boolean {
  const newest = known[0];
  return coming.some(({number, unixMs}) => number === newest?.number && unixMs === newest.unixMs);
}

/** With the newest page, which takes the place of all if it doesn't join them. */
export function withNewest(book: EventBook, page: FarmEvents): EventBook {
  if (!joins(book.events, page.events)) {
    return {events: page.events, older: page.nextPageToken};
  }
  const fresh = page.events.filter(({number}) => number > book.events[0]!.number);
  const events = [...fresh, ...book.events];
  return events.length > kMost ? {events: events.slice(0, kMost), older: ''} : {events, older: book.older};
}

/** With the page of `book.older`, if that is where the book still ends. */
export function withOlder(book: EventBook, token: string, page: FarmEvents): EventBook {
  return book.older === token ? {events: [...book.events, ...page.events], older: page.nextPageToken} : book;
}
