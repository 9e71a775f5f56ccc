/** The workers page. */
import {Fragment} from 'preact';
import {useState} from 'preact/hooks';
import {drainWorker, quarantineWorker, releaseWorker} from '../api/actions';
import {counted, humanCount, humanRate, humanSeconds} from '../model/format';
import {refusalOf} from '../model/rights';
import {healthOf} from '../model/workers';
import type {Worker} from '../wire/lightmill/v1/farm_pb';
import {ActionButton} from './bits';
import {EventLog} from './event_log';
import {FarmCharts} from './farm_charts';
import {useFarm} from './store';
import {WorkerHistoryPanel} from './worker_history';

interface RowProps {
  worker: Worker;
  /** Whether its history is shown. */
  open: boolean;
  onOpen: () => void;
  onFailure: (message: string) => void;
}

function Row({worker, open, onOpen, onFailure}: RowProps) {
  const health = healthOf(worker);
  const {greeting} = useFarm();
  return (
    <tr>
      <td class="name">
        <span class="two-lines">
          <button type="button" class="quiet opener" aria-expanded={open} title="Show its last hour" onClick={onOpen}>
            {worker.name}
          </button>
          <small>{worker.away ? worker.host : `${worker.host} · process ${worker.pid}`}</small>
          {worker.quarantine && <small>{worker.quarantine}</small>}
        </span>
      </td>
      <td>
        <span class={`badge state-${health.kind}`}>{health.name}</span>
      </td>
      <td class="right">{humanRate(worker.samplesPerSecond)}</td>
      <td class="right" data-label="threads">
        {worker.away ? '–' : worker.threads}
      </td>
      <td class="right" data-label="units">
        {worker.leases}
      </td>
      <td class="right wide">{humanCount(Number(worker.results))}</td>
      <td class={`right wide ${worker.leasesLost > 0n ? 'warn' : ''}`}>{String(worker.leasesLost)}</td>
      <td class="wide">
        <code title={worker.fingerprintClass}>{worker.fingerprintClass.slice(0, 12)}</code>
      </td>
      <td class="right wide">{humanSeconds(worker.connectedSeconds)}</td>
      <td class="right acts">
        {worker.quarantine && (
          <ActionButton
            label="Release"
            title="Release it and all others of its identity from quarantine"
            question={`Release ${worker.name} and all others of its identity from quarantine?`}
            refused={refusalOf(greeting, 'ReleaseWorker')}
            act={() => releaseWorker(worker.name)}
            onFailure={onFailure}
          />
        )}
        {!worker.quarantine && !worker.away && (
          <ActionButton
            label="Quarantine"
            title="Give no work to it and all others of its identity until they are released"
            question={`Quarantine ${worker.name} and all others of its identity? They get no work until they are released.`}
            refused={refusalOf(greeting, 'QuarantineWorker')}
            act={() => quarantineWorker(worker.name)}
            onFailure={onFailure}
          />
        )}
        {!worker.draining && !worker.away && (
          <ActionButton
            label="Drain"
            title="Let it finish its units and leave the farm"
            question={`Drain ${worker.name}? It finishes its units and leaves the farm.`}
            refused={refusalOf(greeting, 'DrainWorker')}
            act={() => drainWorker(worker.name)}
            onFailure={onFailure}
          />
        )}
      </td>
    </tr>
  );
}

const kHeads: [string, string][] = [
  ['Worker', ''],
  ['State', ''],
  ['Speed', 'right'],
  ['Threads', 'right'],
  ['Units', 'right'],
  ['Results', 'right wide'],
  ['Lost leases', 'right wide'],
  ['Class', 'wide'],
  ['Connected', 'right wide'],
];

export function WorkersPage({theme}: {theme: string}) {
  const {workers, listed} = useFarm();
  const [failure, setFailure] = useState('');
  const [opened, setOpened] = useState('');
  const all = [...workers.values()].sort((a, b) => (a.name < b.name ? -1 : 1));
  const speed = all.reduce((sum, worker) => sum + worker.samplesPerSecond, 0);
  const threads = all.reduce((sum, worker) => sum + worker.threads, 0);
  const away = all.filter((worker) => worker.away).length;
  return (
    <section class="page" aria-labelledby="workers-title">
      <div class="toolbar">
        <h1 id="workers-title">Workers</h1>
        <p class="summary">
          {all.length - away} connected · {counted(threads, 'thread')} · {humanRate(speed)}
        </p>
      </div>
      {failure && (
        <p class="notice failure" role="alert">
          {failure}
        </p>
      )}
      <table class="list workers">
        <caption class="sr-only">Workers of this farm</caption>
        <thead>
          <tr>
            {kHeads.map(([label, kind]) => (
              <th key={label} scope="col" class={kind}>
                {label}
              </th>
            ))}
            <th scope="col" class="right">
              <span class="sr-only">Actions</span>
            </th>
          </tr>
        </thead>
        <tbody>
          {all.map((worker) => (
            <Fragment key={worker.name}>
              <Row worker={worker} open={opened === worker.name} onOpen={() => setOpened(opened === worker.name ? '' : worker.name)} onFailure={setFailure} />
              {opened === worker.name && (
                <tr class="history">
                  <td colSpan={kHeads.length + 1}>
                    <WorkerHistoryPanel name={worker.name} theme={theme} />
                  </td>
                </tr>
              )}
            </Fragment>
          ))}
        </tbody>
      </table>
      {all.length === 0 && (
        <p class="empty">
          {listed ? (
            <>
              No workers. Start one: <code>lightmill-worker --server HOST:7350</code>
            </>
          ) : (
            'Loading…'
          )}
        </p>
      )}
      <FarmCharts theme={theme} />
      <EventLog />
    </section>
  );
}
