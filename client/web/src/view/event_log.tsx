/** The farm's events and the action log, newest first. */
import {useEffect, useState} from 'preact/hooks';
import {fetchEvents} from '../api/farm_activity';
import {kEventKinds, withNewest, withOlder, type EventPages, type EventKind} from '../model/farm_events';
import {ageText, momentText} from '../model/format';
import type {FarmEvent} from '../wire/lightmill/v1/web_pb';
import {usePolled} from './polled';
import {useFarm} from './store';

const kEveryMs = 5_000;
const kPage = 100;
const kShown = 30;

export function EventList({events, label}: {events: readonly FarmEvent[]; label: string}) {
  const now = Date.now();
  return (
    <ol class="events" aria-label={label}>
      {events.map((event) => {
        const time = new Date(Number(event.unixMs));
        return (
          <li key={String(event.number)} class={event.warning ? 'warn' : ''}>
            <time dateTime={time.toISOString()} title={ageText(time.getTime(), now)}>
              {momentText(time.getTime(), now)}
            </time>
            <span class="text">
              {event.warning && <span class="sr-only">Warning: </span>}
              {event.text}
            </span>
            {event.job !== 0n && <a href={`#/jobs/${event.job}`}>job {String(event.job)}</a>}
          </li>
        );
      })}
    </ol>
  );
}

function Events({kind}: {kind: EventKind}) {
  const [pages, setPages] = useState<EventPages>();
  const [shown, setShown] = useState(kShown);
  const [failedPage, setFailedPage] = useState('');
  const [page, failure] = usePolled((signal) => fetchEvents({kind, size: kPage}, signal), kind, kEveryMs);
  useEffect(() => {
    if (page) {
      setPages((before) => withNewest(before ?? {events: [], older: ''}, page));
    }
  }, [page]);
  const more = async ({events, older}: EventPages) => {
    setFailedPage('');
    if (shown + kShown > events.length && older !== '') {
      try {
        const next = await fetchEvents({kind, size: kPage, token: older});
        setPages((before) => before && withOlder(before, older, next));
      } catch (error) {
        return setFailedPage(error instanceof Error ? error.message : String(error));
      }
    }
    setShown(shown + kShown);
  };
  return (
    <>
      {(failure || failedPage) && (
        <p class="notice failure" role="alert">
          {failure || failedPage}
        </p>
      )}
      <EventList events={pages?.events.slice(0, shown) ?? []} label="Events, newest first" />
      {pages?.events.length === 0 && <p class="muted">No events yet{kind !== 'all' && ' of this kind'}. The coordinator keeps the last 5,000 events since its start.</p>}
      {pages && (pages.events.length > shown || pages.older !== '') && (
        <button type="button" onClick={() => void more(pages)}>
          Older events
        </button>
      )}
    </>
  );
}

export function EventLog() {
  const [kind, setKind] = useState<EventKind>('all');
  const {greeting} = useFarm();
  const kinds = kEventKinds.filter((each) => each !== 'actions' || greeting?.may.includes('ListActions'));
  return (
    <section aria-labelledby="events-title">
      <div class="toolbar">
        <h2 id="events-title">Events</h2>
        <div class="chips" role="group" aria-label="Kind of events">
          {kinds.map((each) => (
            <button key={each} type="button" aria-pressed={kind === each} onClick={() => setKind(each)}>
              {each}
            </button>
          ))}
        </div>
      </div>
      <Events key={kind} kind={kind} />
    </section>
  );
}
