/** One job: its picture, its error, its properties and its actions. */
import {useEffect, useMemo, useRef, useState} from 'preact/hooks';
import type {Point} from '../model/camera';
import type {Film} from '../model/film';
import {reachedName, stateName} from '../model/format';
import {kHalfValues} from '../model/half';
import {emptyText} from '../model/jobs';
import {defaultLayer, failureOf, kDenoised, lightLayers, shownLayers} from '../model/layers';
import {routeHash, type JobView} from '../model/route';
import {exposureFor, luminance} from '../model/tone';
import type {Job} from '../wire/lightmill/v1/farm_pb';
import {Progress, StateBadge} from './bits';
import {ClonePanel} from './clone_panel';
import {ComparePanel} from './compare_panel';
import {useMeasurement} from './comparison';
import {Controls} from './controls';
import {usePhotonOverlay} from './photon_overlay';
import {downloadPng} from './download';
import {EditPanel} from './edit_panel';
import {useEditor} from './editor';
import {ErrorChart} from './error_chart';
import {HistogramView, PixelInspector, useFilmVersion} from './inspector';
import {JobPanel, type JobTask} from './job_panel';
import {useReference, useReferenceFile} from './reference';
import {MetersPanel, useMeters, type MeterRow} from './meters';
import {RegionPanel} from './region_panel';
import {useRelit} from './relight';
import {RelightPanel} from './relight_panel';
import {farm, useFarm, useHasTiles} from './store';
import {Viewer} from './viewer';

/** Luminances of evenly spaced pixels. */
function someLuminances(film: Film): Float32Array {
  const step = 4 * Math.max(1, Math.floor(film.rgbe.length / 4 / 50_000));
  const values: number[] = [];
  for (let i = 0; i < film.rgbe.length; i += step) {
    values.push(luminance([kHalfValues[film.rgbe[i]!]!, kHalfValues[film.rgbe[i + 1]!]!, kHalfValues[film.rgbe[i + 2]!]!]));
  }
  return Float32Array.from(values);
}

function endText(job: Job): string {
  const reached = reachedName(job.reached);
  const reason = job.reason === stateName(job.state) ? '' : job.reason;
  return reason || (reached && `reached its goal in ${reached}`);
}

function ViewerKeys({comparing}: {comparing: boolean}) {
  return (
    <p id="viewer-keys" class="keys-line">
      <kbd>+</kbd> <kbd>−</kbd> zoom · <kbd>F</kbd> fit · <kbd>1</kbd> 1:1 · <kbd>E</kbd> <kbd>⇧E</kbd> exposure · <kbd>N</kbd> auto · <kbd>V</kbd> view · <kbd>R</kbd> reset · <kbd>M</kbd> region
      {comparing && (
        <>
          {' '}
          · <kbd>B</kbd> this picture or the reference · <kbd>S</kbd> split <kbd>[</kbd> <kbd>]</kbd> · <kbd>D</kbd> difference · <kbd>Q</kbd> squared error · <kbd>P</kbd> FLIP
        </>
      )}
    </p>
  );
}

function EditKeys() {
  return (
    <p id="viewer-keys" class="keys-line">
      The camera: drag or <kbd>←</kbd> <kbd>→</kbd> <kbd>↑</kbd> <kbd>↓</kbd> to turn it · with Shift, the second button or two fingers to move it · wheel or <kbd>+</kbd> <kbd>−</kbd> nearer and farther
    </p>
  );
}

const kNone: readonly string[] = [];
const kNoMeters: readonly MeterRow[] = [];
const kDirections = 'normal';
const kDepth = 'depth';

/** Depths have no common scale, so the exposure is set when the first values arrive. */
function useFirstExposure(film: Film | undefined, normalize: () => void): void {
  const done = useRef<Film>();
  useFilmVersion(film, 100);
  useEffect(() => {
    if (film && film !== done.current && film.mostSamples() > 0) {
      done.current = film;
      normalize();
    }
  });
}

export interface JobPageProps {
  id: bigint;
  /** The view in the address. It is a new object after each navigation. */
  linked: JobView;
  theme: string;
}

export function JobPage({id, linked, theme}: JobPageProps) {
  const {job, film: beauty, layers, jobFailure, layerFailures} = useFarm();
  const [view, setView] = useState(linked);
  useEffect(() => setView(linked), [linked]);
  const [point, setPoint] = useState<Point>();
  const [drawing, setDrawing] = useState(false);
  const [copied, setCopied] = useState(false);
  const [task, setTask] = useState<JobTask>();
  const editing = task === 'edit';
  const {editor, failure: notEdited} = useEditor(id, editing);
  const {camera, against, region} = view;
  const pictures = useMemo(() => shownLayers(job?.layers ?? []), [job?.layers.join()]);
  const chosen = view.layer !== undefined && ['', ...pictures].includes(view.layer) ? view.layer : undefined;
  const wanted = chosen ?? defaultLayer(pictures, view.display.show, view.relight, against !== undefined);
  // A denoised picture that cannot be shown, and that nobody has chosen, is no failure.
  const layer = chosen === undefined && layerFailures.has(wanted) ? '' : wanted;
  const lights = useMemo(() => lightLayers(job?.layers ?? []), [job?.layers.join()]);
  const mixing = view.relight.size > 0 && layer === '' && !editing;
  const relit = useRelit(job, mixing ? lights : kNone, view.relight, layers);
  useEffect(() => farm.watchLayers(wanted ? [wanted] : mixing ? lights : kNone), [id, wanted, mixing, lights]);
  // The raw picture is shown until there is a denoised one.
  const film = layer === kDenoised ? (layers.get(layer) ?? beauty) : layer ? layers.get(layer) : (relit ?? beauty);
  const notShown = failureOf(layerFailures, layer ? [layer] : mixing ? ['', ...lights] : ['']);
  const display = useMemo(() => (layer === kDirections ? {...view.display, signed: true} : view.display), [layer, view.display]);
  const seen = editor?.film ?? film;
  const empty = !useHasTiles(seen) && !notShown;
  const meters = useMeters(job);
  const photonMap = usePhotonOverlay(id, editing || !job ? 'none' : view.photons);
  const change = (by: Partial<JobView>) => setView((before) => ({...before, ...by}));
  const [file, chooseFile, fileFailure] = useReferenceFile();
  const reference = useReference(film, against, file);
  const measurement = useMeasurement(film, reference?.film, against?.how === 'hdr-flip', display.exposure);
  useEffect(() => {
    // The address follows the view after a delay, because browsers limit such changes. It is left alone if the user has navigated
    // meanwhile.
    const {hash} = window.location;
    const follow = () => hash === window.location.hash && history.replaceState(null, '', routeHash({page: 'job', job: id, ...view}));
    const timer = setTimeout(follow, 250);
    return () => clearTimeout(timer);
  }, [id, view]);
  const onFile = async (chosen: File) => {
    if (await chooseFile(chosen)) {
      change({against: {how: 'split', split: 0.5, ...against, other: 'file'}});
    }
  };
  const onDisplay = ({signed, ...next}: JobView['display']) => change({display: next});
  const exposureBefore = useRef(view.display.exposure);
  const onLayer = (next: string) => {
    // The exposure of depth is not used for other layers.
    const exposure = layer === kDepth ? exposureBefore.current : view.display.exposure;
    exposureBefore.current = exposure;
    change({layer: next, display: {...view.display, exposure}});
  };
  useFirstExposure(layer === kDepth ? film : undefined, () => normalize());
  const normalize = () => film && onDisplay({...display, exposure: exposureFor(someLuminances(film))});
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
          {job?.name || `Job ${id}`} {job?.name && <span class="muted">#{String(id)}</span>}
        </h1>
        {job && <StateBadge state={job.state} />}
        {job && <Progress job={job} />}
        {job && endText(job) && <span class="muted">{endText(job)}</span>}
        <span class="spacer" />
        <a class="button" href={`api/v1/jobs/${id}/picture.exr`} download={`job-${id}.exr`} title="The whole film: layers, halves, counts, receipt">
          EXR
        </a>
        <button type="button" disabled={!film} title="What is shown: the chosen layer, with exposure and view" onClick={() => film && void downloadPng(film, display, `job-${id}${film.layer ? `-${film.layer.replace(':', '-')}` : ''}`)}>
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
          display={display}
          layers={pictures}
          layer={layer}
          against={against}
          drawing={drawing}
          onDisplay={onDisplay}
          onLayer={onLayer}
          onNormalize={normalize}
          photons={view.photons}
          onPhotons={(photons) => change({photons})}
          onAgainst={(next) => change({against: next})}
          onFile={(chosen) => void onFile(chosen)}
          onDrawing={setDrawing}
        />
        {photonMap.failure && (
          <p class="notice failure" role="alert">
            The photon map cannot be shown: {photonMap.failure}
          </p>
        )}
        {notShown && (
          <p class="notice failure" role="alert">
            {notShown}
          </p>
        )}
        {fileFailure && (
          <p class="notice failure" role="alert">
            {fileFailure}
          </p>
        )}
        {empty && (
          <p class="notice" role="status">
            {emptyText(job)}
          </p>
        )}
        <Viewer
          film={seen}
          display={display}
          camera={editing ? undefined : camera}
          theme={theme}
          other={editing ? undefined : reference?.film}
          against={editing ? undefined : against}
          photonMap={photonMap.film}
          meters={editing || !view.meters ? kNoMeters : meters}
          errorMap={editing ? undefined : measurement?.flip?.map}
          region={editing ? undefined : region}
          drawing={drawing}
          steering={editor?.steering}
          onDisplay={onDisplay}
          onCamera={(next) => change({camera: next})}
          onAgainst={(next) => change({against: next})}
          onRegion={(next) => change({region: next})}
          onDrawing={setDrawing}
          onFile={(chosen) => void onFile(chosen)}
          onPoint={setPoint}
          onNormalize={normalize}
        />
        {editing ? <EditKeys /> : <ViewerKeys comparing={against !== undefined} />}
      </div>
      <aside class="side" aria-label="About this job">
        {editor && <EditPanel id={id} editor={editor} onClose={() => setTask(undefined)} />}
        {notEdited && (
          <p class="notice failure" role="alert">
            The job cannot be edited: {notEdited}
          </p>
        )}
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
        {lights.length > 0 && !editing && <RelightPanel lights={lights} relight={view.relight} onRelight={(relight) => change({relight, layer: undefined})} />}
        {film && reference && <ComparePanel reference={reference} measurement={measurement} pixels={film.crop.width * film.crop.height} />}
        {meters.length > 0 && <MetersPanel rows={meters} shown={view.meters} onShown={(shown) => change({meters: shown})} />}
        {region && <RegionPanel film={film} region={region} onRegion={(next) => change({region: next})} />}
        <PixelInspector film={seen} other={editing ? undefined : reference?.film} at={point} />
        <HistogramView film={seen} exposure={display.exposure} />
        {job && (
          <JobPanel job={job} open={task} onOpen={setTask}>
            {task === 'clone' && <ClonePanel id={id} onClose={() => setTask(undefined)} />}
          </JobPanel>
        )}
      </aside>
    </section>
  );
}

/** Watches a job. */
export function useWatch(job: bigint): void {
  useEffect(() => farm.watch(job), [job]);
}
