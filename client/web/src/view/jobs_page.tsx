/** The list of jobs: search, filters, order; by mouse, finger or keys. */
import {useEffect, useMemo, useRef, useState} from 'preact/hooks';
import {thumbnailAddress} from '../api/actions';
import {ageText, goalText, kMixed, methodName, samplesText} from '../model/format';
import {filterCounts, hasEnded, kNewestFirst, listedJobs, type JobFilter, type JobOrder, type JobQuery} from '../model/jobs';
import type {Job} from '../wire/lightmill/v1/farm_pb';
import {ErrorValue, etaText, Progress, StateBadge} from './bits';
import {ChooseFiles, DropZone} from './drop_zone';
import type {SceneFile} from './dropped';
import {useFarm} from './store';
import {SubmitPanel} from './submit_panel';

const kColumns: {order: JobOrder; label: string; class?: string}[] = [
  {order: 'name', label: 'Job'},
  {order: 'state', label: 'State'},
  {order: 'progress', label: 'Progress'},
  {order: 'error', label: 'Error', class: 'right'},
  {order: 'eta', label: 'ETA', class: 'right'},
  {order: 'method', label: 'Method', class: 'wide'},
  {order: 'owner', label: 'Owner', class: 'wide'},
  {order: 'priority', label: 'Priority', class: 'wide right'},
  {order: 'id', label: 'Submitted', class: 'wide right'},
];

const kFilters: {filter: JobFilter; label: string}[] = [
  {filter: 'all', label: 'All'},
  {filter: 'active', label: 'Active'},
  {filter: 'done', label: 'Done'},
  {filter: 'failed', label: 'Failed or cancelled'},
];

const kThumbnailMs = 4_000;

/** A version that changes with a job's pixels, at most once every few seconds. */
function useThumbnailVersion(job: Job): string {
  const [shown, setShown] = useState({version: String(job.samplesDone), at: 0});
  useEffect(() => {
    const version = String(job.samplesDone);
    if (version === shown.version) {
      return;
    }
    const wait = hasEnded(job.state) ? 0 : Math.max(0, shown.at + kThumbnailMs - Date.now());
    const timer = setTimeout(() => setShown({version, at: Date.now()}), wait);
    return () => clearTimeout(timer);
  }, [job.samplesDone, job.state, shown]);
  return shown.version;
}

function Thumbnail({job}: {job: Job}) {
  const version = useThumbnailVersion(job);
  const some = job.samplesDone > 0n;
  return <span class="thumbnail">{some && <img src={thumbnailAddress(job.id, version)} alt="" loading="lazy" />}</span>;
}

function Row({job, now}: {job: Job; now: number}) {
  return (
    <tr>
      <td class="name">
        <a href={`#/jobs/${job.id}`} class="row-link">
          <Thumbnail job={job} />
          <span class="two-lines">
            <strong>{job.name || `job ${job.id}`}</strong>
            <small>
              #{String(job.id)} · {job.width}×{job.height} · {goalText(job)}
            </small>
          </span>
        </a>
      </td>
      <td>
        <StateBadge state={job.state} />
        {job.reason && !hasEnded(job.state) && <small class="reason">{job.reason}</small>}
      </td>
      <td>
        <Progress job={job} />
        <small>{samplesText(job)} samples</small>
      </td>
      <td class="right">
        <ErrorValue job={job} />
      </td>
      <td class="right" data-label="ETA">
        {etaText(job)}
      </td>
      <td class="wide">
        {methodName(job)} {job.allowMixed ? <abbr title={kMixed}>mixed</abbr> : null} {job.methodNotes?.notices.length ? <abbr title={job.methodNotes.notices.join(' ')}>!</abbr> : null}
      </td>
      <td class="wide">{job.owner}</td>
      <td class="wide right">{job.priority}</td>
      <td class="wide right">{ageText(Number(job.submittedUnixMs), now)}</td>
    </tr>
  );
}

function useNow(everyMs: number): number {
  const [now, setNow] = useState(Date.now());
  useEffect(() => {
    const timer = setInterval(() => setNow(Date.now()), everyMs);
    return () => clearInterval(timer);
  }, [everyMs]);
  return now;
}

/** '/' goes to the search. Arrows, or j and k, go from row to row. Enter opens a job, as on any link. */
function useListKeys(search: {current: HTMLInputElement | null}, table: {current: HTMLElement | null}) {
  useEffect(() => {
    const onKey = (event: KeyboardEvent) => {
      const typing = event.target instanceof HTMLInputElement || event.target instanceof HTMLSelectElement;
      if (event.ctrlKey || event.metaKey || event.altKey) {
        return;
      }
      if (event.key === '/' && !typing) {
        event.preventDefault();
        search.current?.focus();
        return;
      }
      const step = {ArrowDown: 1, ArrowUp: -1, j: 1, k: -1}[event.key];
      // From the search the down arrow goes to the first result. Other fields use the arrows themselves.
      if (step === undefined || (typing && !(event.key === 'ArrowDown' && event.target === search.current))) {
        return;
      }
      const links = [...(table.current?.querySelectorAll<HTMLElement>('.row-link') ?? [])];
      const at = links.indexOf(document.activeElement as HTMLElement);
      const next = links[Math.min(Math.max(at + step, 0), links.length - 1)];
      if (next) {
        event.preventDefault();
        next.focus();
      }
    };
    window.addEventListener('keydown', onKey);
    return () => window.removeEventListener('keydown', onKey);
  }, []);
}

export function JobsPage() {
  const {jobs, listed} = useFarm();
  const [query, setQuery] = useState<JobQuery>(kNewestFirst);
  const [dropped, setDropped] = useState<{files: SceneFile[]; nth: number}>();
  const [failure, setFailure] = useState('');
  const search = useRef<HTMLInputElement>(null);
  const table = useRef<HTMLTableElement>(null);
  const now = useNow(10_000);
  const shown = useMemo(() => listedJobs(jobs, query), [jobs, query]);
  const counts = useMemo(() => filterCounts(jobs), [jobs]);
  useListKeys(search, table);
  const sortBy = (order: JobOrder) =>
    setQuery({...query, order, descending: query.order === order ? !query.descending : order === 'id' || order === 'progress'});
  const sortState = (order: JobOrder) => (query.order !== order ? 'none' : query.descending ? 'descending' : 'ascending');
  const take = (files: SceneFile[]) => {
    setFailure('');
    // Files of the same names may have other contents.
    setDropped((before) => ({files, nth: (before?.nth ?? 0) + 1}));
  };
  return (
    <DropZone onFiles={take} onFailure={setFailure}>
      <section class="page" aria-labelledby="jobs-title">
        <div class="toolbar">
          <h1 id="jobs-title">Jobs</h1>
          <ChooseFiles onFiles={take} />
          <div class="chips" role="group" aria-label="Filter">
            {kFilters.map(({filter, label}) => (
              <button type="button" key={filter} aria-pressed={query.filter === filter} onClick={() => setQuery({...query, filter})}>
                {label} <span class="count">{counts[filter]}</span>
              </button>
            ))}
          </div>
          <input
            ref={search}
            type="search"
            placeholder="Search  ( / )"
            aria-label="Search jobs by name, owner, method, state or number"
            value={query.search}
            onInput={(event) => setQuery({...query, search: event.currentTarget.value})}
          />
        </div>
        {failure && (
          <p class="notice failure" role="alert">
            {failure}
          </p>
        )}
        {dropped && <SubmitPanel key={dropped.nth} files={dropped.files} onClose={() => setDropped(undefined)} />}
        <table class="list jobs" ref={table}>
          <caption class="sr-only">Jobs of this farm</caption>
          <thead>
            <tr>
              {kColumns.map(({order, label, class: kind}) => (
                <th key={order} scope="col" class={kind} aria-sort={sortState(order)}>
                  <button type="button" class="sort" onClick={() => sortBy(order)}>
                    {label}
                  </button>
                </th>
              ))}
            </tr>
          </thead>
          <tbody>
            {shown.map((job) => (
              <Row key={String(job.id)} job={job} now={now} />
            ))}
          </tbody>
        </table>
        {shown.length === 0 && <Empty listed={listed} any={jobs.size > 0} />}
      </section>
    </DropZone>
  );
}

function Empty({listed, any}: {listed: boolean; any: boolean}) {
  if (!listed) {
    return <p class="empty">Loading…</p>;
  }
  return any ? (
    <p class="empty">No job matches.</p>
  ) : (
    <p class="empty">
      No jobs yet. Drop a scene here with its files, or submit one: <code>lightmill submit scenes/cornell-bench-balls.json --spp 256</code>
    </p>
  );
}
