/** One job: its picture, how its error falls, what it is, and what can be done with it. */
import {useEffect, useRef, useState} from 'preact/hooks';
import {actOnJob, extendJob} from '../api/actions';
import type {Point} from '../model/camera';
import type {Film} from '../model/film';
import {ageText, errorText, goalText, humanRate, humanSeconds, methodName, reachedName, samplesText} from '../model/format';
import {hasEnded} from '../model/jobs';
import {kHalfValues} from '../model/half';
import {routeHash, type JobView} from '../model/route';
import {refusalOf} from '../model/rights';
import {exposureFor, luminance} from '../model/tone';
import {JobState, type Job} from '../wire/lightmill/v1/farm_pb';
import {ActionButton, etaText, Progress, StateBadge} from './bits';
import {ComparePanel} from './compare_panel';
import {useMeasurement} from './comparison';
import {Controls} from './controls';
import {downloadPng} from './download';
import {ErrorChart} from './error_chart';
import {HistogramView, PixelInspector} from './inspector';
import {useReference, useReferenceFile} from './reference';
import {RegionPanel} from './region_panel';
import {farm, useFarm} from './store';
import {Viewer} from './viewer';

/** Of every so-manieth pixel. */
function someLuminances(film: Film): Float32Array {
  const step = 4 * Math.max(1, Math.floor(film.rgbe.length / 4 / 50_000));
  const values: number[] = [];
  for (let i = 0; i < film.rgbe.length; i += step) {
    values.push(luminance([kHalfValues[film.rgbe[i]!]!, kHalfValues[film.rgbe[i + 1]!]!, kHalfValues[film.rgbe[i + 2]!]!]));
  }
  return Float32Array.from(values);
}

/** What a job is extended in: its error if it has such a goal, else its samples; and what is offered. */
function offeredGoal(job: Job): {label: string; offer: number; goal: (value: number) => {samples?: number; error?: number}} {
  const error = job.goal?.error ?? 0;
  if (error > 0) {
    const percent = Number((50 * Math.sqrt(error)).toPrecision(2));
    return {label: 'New error, ±%', offer: percent, goal: (value) => ({error: (value / 100) ** 2})};
  }
  const samples = Number(job.goal?.samples ?? 0n) || Math.max(Number(job.frameSamples), 1);
  return {label: 'New total of samples', offer: 2 * samples, goal: (value) => ({samples: Math.round(value)})};
}

function Extend({job, onFailure}: {job: Job; onFailure: (message: string) => void}) {
  const [text, setText] = useState('');
  const {greeting} = useFarm();
  const {label, offer, goal} = offeredGoal(job);
  return (
    <form class="extend" onSubmit={(event) => event.preventDefault()}>
      <label>
        {label}
        <input type="number" min={0} step="any" inputMode="decimal" placeholder={String(offer)} value={text} onInput={(event) => setText(event.currentTarget.value)} />
      </label>
      <ActionButton label="Extend" title="Give the job this goal; a finished one goes on" refused={refusalOf(greeting, 'ExtendJob', job.owner)} act={() => extendJob(job.id, goal(Number(text) || offer))} onFailure={onFailure} />
    </form>
  );
}

function Actions({job}: {job: Job}) {
  const [failure, setFailure] = useState('');
  const {greeting} = useFarm();
  const refused = (method: string) => refusalOf(greeting, method, job.owner);
  const act = (action: 'pause' | 'resume' | 'cancel') => () => actOnJob(job.id, action);
  const ended = hasEnded(job.state);
  const extendable = job.state !== JobState.FAILED && job.state !== JobState.CANCELLED;
  return (
    <div class="actions">
      {job.state === JobState.PAUSED ? (
        <ActionButton label="Resume" refused={refused('ResumeJob')} act={act('resume')} onFailure={setFailure} />
      ) : (
        !ended && <ActionButton label="Pause" refused={refused('PauseJob')} act={act('pause')} onFailure={setFailure} />
      )}
      {!ended && (
        <ActionButton label="Cancel" danger question={`Cancel job ${job.id}? What is rendered stays.`} refused={refused('CancelJob')} act={act('cancel')} onFailure={setFailure} />
      )}
      {extendable && <Extend job={job} onFailure={setFailure} />}
      {failure && (
        <p class="notice failure" role="alert">
          {failure}
        </p>
      )}
    </div>
  );
}

function Facts({job}: {job: Job}) {
  const rows: [string, string][] = [
    ['Goal', goalText(job)],
    ['Samples', samplesText(job)],
    ['Error', errorText(job.error?.relMse) || '–'],
    ['Speed', job.state === JobState.RUNNING ? humanRate(job.samplesPerSecond) : '–'],
    ['ETA', etaText(job) || '–'],
    ['Rendered for', `${humanSeconds(job.activeSeconds)} (${humanSeconds(job.workerSeconds)} of threads)`],
    ['Method', methodName(job)],
    ['Size', `${job.width}×${job.height}`],
    ['Owner', job.owner ? `${job.owner}${job.host ? ` on ${job.host}` : ''}` : '–'],
    ['Priority', String(job.priority)],
    ['Submitted', ageText(Number(job.submittedUnixMs), Date.now())],
    ['Class', job.fingerprintClass.slice(0, 16) || '–'],
  ];
  return (
    <dl class="facts">
      {rows.map(([name, value]) => (
        <div key={name}>
          <dt>{name}</dt>
          <dd>{value}</dd>
        </div>
      ))}
    </dl>
  );
}

function endText(job: Job): string {
  const reached = reachedName(job.reached);
  return job.reason || (reached && `reached its goal in ${reached}`);
}

export interface JobPageProps {
  id: bigint;
  /** At first. */
  view: JobView;
  theme: string;
}

export function JobPage({id, view: firstView, theme}: JobPageProps) {
  const {job, film, jobFailure} = useFarm();
  const [view, setView] = useState(firstView);
  const [point, setPoint] = useState<Point>();
  const [drawing, setDrawing] = useState(false);
  const [copied, setCopied] = useState(false);
  const {look, camera, against, region} = view;
  const change = (by: Partial<JobView>) => setView((before) => ({...before, ...by}));
  const [file, chooseFile, fileFailure] = useReferenceFile();
  const reference = useReference(film, against, file);
  const measurement = useMeasurement(film, reference?.film, against?.how === 'hdr-flip', look.exposure);
  useEffect(() => {
    // The address follows the view, a moment later: browsers allow only so many changes.
    const timer = setTimeout(() => history.replaceState(null, '', routeHash({page: 'job', job: id, ...view})), 250);
    return () => clearTimeout(timer);
  }, [id, view]);
  const onFile = async (chosen: File) => {
    if (await chooseFile(chosen)) {
      change({against: {how: 'split', split: 0.5, ...against, other: 'file'}});
    }
  };
  const onLook = (next: JobView['look']) => change({look: next});
  const normalize = () => film && onLook({...look, exposure: exposureFor(someLuminances(film))});
  const copyLink = async () => {
    const address = new URL(routeHash({page: 'job', job: id, ...view}), window.location.href);
    await navigator.clipboard.writeText(address.href);
    setCopied(true);
    setTimeout(() => setCopied(false), 2_000);
  };
  const title = useRef<HTMLHeadingElement>(null);
  if (jobFailure) {
    return (
      <section class="page">
        <h1>Job {String(id)}</h1>
        <p class="notice failure" role="alert">
          {jobFailure}
        </p>
        <p>
          <a href="#/jobs">All jobs</a>
        </p>
      </section>
    );
  }
  return (
    <section class="job-page" aria-labelledby="job-title">
      <header class="job-head">
        <a href="#/jobs" class="back" aria-label="All jobs">
          ‹ Jobs
        </a>
        <h1 id="job-title" ref={title}>
          {job ? job.name || `job ${job.id}` : `Job ${id}`} <span class="muted">#{String(id)}</span>
        </h1>
        {job && <StateBadge state={job.state} />}
        {job && <Progress job={job} />}
        {job && endText(job) && <span class="muted">{endText(job)}</span>}
        <span class="spacer" />
        <a class="button" href={`api/v1/jobs/${id}/picture.exr`} download={`job-${id}.exr`} title="All that the film holds: layers, halves, counts, receipt">
          EXR
        </a>
        <button type="button" disabled={!film} onClick={() => film && void downloadPng(film, look, `job-${id}`)}>
          PNG
        </button>
        <button type="button" onClick={() => void copyLink()}>
          {copied ? 'Copied' : 'Copy link'}
        </button>
      </header>
      <div class="stage">
        <Controls
          film={film}
          job={job}
          look={look}
          against={against}
          drawing={drawing}
          onLook={onLook}
          onNormalize={normalize}
          onAgainst={(next) => change({against: next})}
          onFile={(chosen) => void onFile(chosen)}
          onDrawing={setDrawing}
        />
        {fileFailure && (
          <p class="notice failure" role="alert">
            {fileFailure}
          </p>
        )}
        <Viewer
          film={film}
          look={look}
          camera={camera}
          theme={theme}
          other={reference?.film}
          against={against}
          errorMap={measurement?.flip?.map}
          region={region}
          drawing={drawing}
          onLook={onLook}
          onCamera={(next) => change({camera: next})}
          onAgainst={(next) => change({against: next})}
          onRegion={(next) => change({region: next})}
          onDrawing={setDrawing}
          onFile={(chosen) => void onFile(chosen)}
          onPoint={setPoint}
          onNormalize={normalize}
        />
        <p id="viewer-keys" class="keys-line">
          <kbd>+</kbd> <kbd>−</kbd> zoom · <kbd>F</kbd> fit · <kbd>1</kbd> 1:1 · <kbd>E</kbd> <kbd>⇧E</kbd> exposure · <kbd>N</kbd> auto · <kbd>V</kbd> view · <kbd>R</kbd> reset · <kbd>M</kbd> region
          {against && (
            <>
              {' '}
              · <kbd>B</kbd> this or the other · <kbd>S</kbd> split <kbd>[</kbd> <kbd>]</kbd> · <kbd>D</kbd> difference · <kbd>Q</kbd> squared error · <kbd>P</kbd> FLIP
            </>
          )}
        </p>
      </div>
      <aside class="side" aria-label="About this job">
        {job?.methodNotes?.notices.map((notice) => (
          <p class="notice" key={notice}>
            {notice}
          </p>
        ))}
        {job && (
          <section class="panel" aria-labelledby="error-title">
            <h2 id="error-title">Error against time</h2>
            <ErrorChart job={job} theme={theme} charted={view.charted} onCharted={(charted) => change({charted})} />
          </section>
        )}
        {film && reference && <ComparePanel reference={reference} measurement={measurement} pixels={film.crop.width * film.crop.height} />}
        {region && <RegionPanel film={film} region={region} onRegion={(next) => change({region: next})} />}
        <PixelInspector film={film} other={reference?.film} at={point} />
        <HistogramView film={film} exposure={look.exposure} />
        {job && (
          <section class="panel" aria-labelledby="facts-title">
            <h2 id="facts-title">Job</h2>
            <Facts job={job} />
            <Actions job={job} />
          </section>
        )}
      </aside>
    </section>
  );
}

/** Tells the coordinator which job is looked at. */
export function useWatch(job: bigint): void {
  useEffect(() => farm.watch(job), [job]);
}
