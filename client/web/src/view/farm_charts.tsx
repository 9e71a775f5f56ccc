/** Charts of the farm over time: speed, threads, queue. */
import {useMemo, useState} from 'preact/hooks';
import {fetchHistory} from '../api/farm_activity';
import {csvOfHistory, farmWindow, kSpans, seriesOf, utilisation} from '../model/farm_history';
import {humanRate} from '../model/format';
import type {FarmHistory} from '../wire/lightmill/v1/web_pb';
import {save} from './download';
import {usePolled} from './polled';
import {TimePanel} from './time_panel';

const kEveryMs = 10_000;

/** Means over five minutes are fractions. */
function few(value: number): string {
  return Number.isInteger(value) ? String(value) : value.toFixed(1);
}

function Panels({history, span, theme}: {history: FarmHistory; span: number; theme: string}) {
  const [at, setAt] = useState<number>();
  const series = useMemo(() => seriesOf(history), [history]);
  const {times} = series;
  const shared = {times, window: farmWindow(history, span), together: 'farm', theme, at, onHover: setAt};
  return (
    <div class="farm-charts">
      <TimePanel {...shared} title="Throughput, samples/s" lines={[{name: 'merged', color: '--accent', filled: true, values: series.rate}]} write={humanRate} />
      <TimePanel
        {...shared}
        title="Threads"
        lines={[
          {name: 'all', color: '--ink-2', dashed: true, values: series.threads},
          {name: 'busy', color: '--accent', filled: true, values: series.busy},
        ]}
        whole
        write={few}
      />
      <TimePanel
        {...shared}
        title="Jobs"
        lines={[
          {name: 'rendering', color: '--accent', filled: true, values: series.running},
          {name: 'waiting', color: '--info', dashed: true, values: series.waiting},
        ]}
        whole
        write={few}
      />
    </div>
  );
}

export function FarmCharts({theme}: {theme: string}) {
  const [span, setSpan] = useState<number>(kSpans[1].seconds);
  const [history, failure] = usePolled((signal) => fetchHistory(span, signal), String(span), kEveryMs);
  const used = history && utilisation(history);
  return (
    <section aria-labelledby="farm-title">
      <div class="toolbar">
        <h2 id="farm-title">History</h2>
        <div class="chips" role="group" aria-label="Time span">
          {kSpans.map(({seconds, name}) => (
            <button key={name} type="button" aria-pressed={span === seconds} onClick={() => setSpan(seconds)}>
              {name}
            </button>
          ))}
        </div>
        {used !== undefined && <p class="summary">{used.toFixed(0)}% of threads busy</p>}
        {history && history.samples.length > 0 && (
          <button type="button" class="push" title="Save as a file" onClick={() => save(new Blob([csvOfHistory(history)], {type: 'text/csv'}), 'farm-history.csv')}>
            CSV
          </button>
        )}
      </div>
      {failure && (
        <p class="notice failure" role="alert">
          {failure}
        </p>
      )}
      {history?.samples.length === 0 && (
        <p class="muted">No history yet. The coordinator records it from its start, in steps of {span > 3600 ? 'five minutes' : 'ten seconds'}.</p>
      )}
      {history && history.samples.length > 0 ? <Panels key={span} history={history} span={span} theme={theme} /> : !history && <div class="farm-charts pending" />}
    </section>
  );
}
