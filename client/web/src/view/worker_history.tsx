/** A worker's last hour: speed, units, lost leases, and connection times. */
import {useMemo, useState} from 'preact/hooks';
import {fetchEvents, fetchWorkerHistory} from '../api/farm_activity';
import {workerSeriesOf} from '../model/farm_history';
import {counted, humanRate, humanSeconds} from '../model/format';
import {EventList} from './event_log';
import {usePolled} from './polled';
import {TimePanel} from './time_panel';

const kEveryMs = 20_000;
const kShownEvents = 8;

export function WorkerHistoryPanel({name, theme}: {name: string; theme: string}) {
  const [history, failure] = usePolled((signal) => fetchWorkerHistory(name, signal), name, kEveryMs);
  const [page] = usePolled((signal) => fetchEvents({worker: name, size: kShownEvents}, signal), name, kEveryMs);
  const [at, setAt] = useState<number>();
  const series = useMemo(() => history && workerSeriesOf(history), [history]);
  return (
    <div class="worker-history">
      {failure && (
        <p class="notice failure" role="alert">
          {failure}
        </p>
      )}
      {series && series.times.length > 0 ? (
        <TimePanel
          title="Last hour"
          times={series.times}
          window={series.window}
          lines={[{name: 'speed', color: '--accent', filled: true, values: series.rate}]}
          together={name}
          write={humanRate}
          theme={theme}
          at={at}
          onHover={setAt}
        >
          {`: ${counted(series.results, 'result')}, ${counted(series.lost, 'lease')} lost, connected for ${humanSeconds(series.seconds)}`}
        </TimePanel>
      ) : (
        <p class="muted">{series ? 'No history yet. It begins after the first whole minute.' : 'Loading…'}</p>
      )}
      {page && <EventList events={page.events} label={`Events of ${name}`} />}
    </div>
  );
}
