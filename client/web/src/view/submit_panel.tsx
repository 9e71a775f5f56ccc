/** Submission of a dropped scene: upload, inspection by a worker, and the job's settings. */
import {useEffect, useMemo, useRef, useState} from 'preact/hooks';
import type {Inspection} from '../api/inspect';
import {Submitter} from '../api/submit';
import {filledSpec, formOf, newSpec, type JobForm} from '../model/job_form';
import {inPageWords} from '../model/page_words';
import {humanBytes} from '../model/scene_files';
import {ActionButton} from './bits';
import type {SceneFile} from './dropped';
import {JobFields} from './job_fields';
import {inspect, sendFiles, type Progress, type Sent} from './sending';
import {useFarm} from './store';

function Going({progress, onCancel}: {progress: Progress; onCancel: () => void}) {
  const {what, done, total} = progress;
  const known = done !== undefined && total !== undefined && total > 0;
  return (
    <div class="going" role="status">
      <p>
        {what}… {known && <span class="muted">{`${humanBytes(done)} of ${humanBytes(total)}`}</span>}
      </p>
      <progress aria-label={what} value={known ? done : undefined} max={known ? total : undefined} />
      <button type="button" onClick={onCancel}>
        Cancel
      </button>
    </div>
  );
}

function Findings({inspection}: {inspection: Inspection}) {
  const {facts, methods, chosen, notices} = inspection;
  return (
    <div class="findings">
      {notices.map((notice) => (
        <p class="notice" key={notice}>
          {inPageWords(notice)}
        </p>
      ))}
      <section aria-labelledby="facts-found">
        <h3 id="facts-found">The scene</h3>
        <dl class="facts">
          {facts.map(({what, value}) => (
            <div key={what}>
              <dt>{what}</dt>
              <dd>{inPageWords(value)}</dd>
            </div>
          ))}
        </dl>
      </section>
      <section aria-labelledby="methods-found">
        <h3 id="methods-found">
          Methods {chosen.length > 0 && <span class="muted">auto: {chosen.join(' or ')}</span>}
        </h3>
        <ul class="verdicts">
          {methods.map(({method, admitted, reason}) => (
            <li key={method}>
              <strong>{method}</strong> <span class={`badge state-${admitted ? 'done' : 'paused'}`}>{admitted ? 'finds all light' : 'misses light'}</span>
              {reason && <small>{reason}</small>}
            </li>
          ))}
        </ul>
      </section>
    </div>
  );
}

interface State {
  progress: Progress | undefined;
  sent: Sent | undefined;
  inspection: Inspection | undefined;
  failure: string;
}
const kNothing: State = {progress: undefined, sent: undefined, inspection: undefined, failure: ''};

/** The upload and inspection of dropped files. `inspectAgain` inspects another of its scenes, or from another camera. */
function useInspection(files: readonly SceneFile[]) {
  const [state, setState] = useState(kNothing);
  const going = useRef<AbortController>();
  const run = async (work: (signal: AbortSignal) => Promise<Partial<State>>) => {
    going.current?.abort();
    const mine = new AbortController();
    going.current = mine;
    const change = (by: Partial<State>) => mine === going.current && setState((before) => ({...before, ...by}));
    try {
      change({...(await work(mine.signal)), progress: undefined, failure: ''});
    } catch (error) {
      const stopped = error instanceof DOMException && error.name === 'AbortError';
      change({progress: undefined, failure: stopped ? 'Cancelled. Files that the farm already has are not sent again.' : error instanceof Error ? error.message : String(error)});
    }
  };
  const inspectAgain = (sent: Sent, scene: readonly string[], camera: string) =>
    run(async (signal) => {
      setState((before) => ({...before, progress: {what: 'A worker inspects the scene'}}));
      return {inspection: await inspect(sent, scene, camera, signal)};
    });
  const send = () =>
    run(async (signal) => {
      setState({...kNothing, progress: {what: 'Reading the dropped files'}});
      const sent = await sendFiles(files, (progress) => setState((before) => ({...before, progress})), signal);
      setState((before) => ({...before, sent, progress: {what: 'A worker inspects the scene'}}));
      return {sent, inspection: await inspect(sent, sent.choices[0]!, '', signal)};
    });
  useEffect(() => {
    void send();
    return () => {
      going.current?.abort();
      going.current = undefined;
    };
  }, [files]);
  return {...state, inspectAgain, send, cancel: () => going.current?.abort()};
}

function nameOf(scene: readonly string[], inspection: Inspection): string {
  const file = scene[0]!.slice(scene[0]!.lastIndexOf('/') + 1).replace(/\.\w+$/, '');
  return inspection.scene.name || file;
}

export function SubmitPanel({files, onClose}: {files: readonly SceneFile[]; onClose: () => void}) {
  const {greeting} = useFarm();
  const {progress, sent, inspection, failure, inspectAgain, send, cancel} = useInspection(files);
  const [chosen, setChosen] = useState(0);
  const [camera, setCamera] = useState('');
  const [form, setForm] = useState<JobForm>();
  const [refusal, setRefusal] = useState('');
  const sized = useRef<{width: number; height: number}>();
  const submitter = useMemo(() => new Submitter(), []);
  const scene = sent?.choices[chosen];
  useEffect(() => {
    if (inspection && scene) {
      // Settings stay when the camera changes. The size changes if it is still that of the last camera.
      const fresh = formOf(newSpec(inspection.scene, nameOf(scene, inspection)));
      const {width, height} = fresh;
      setForm((before) => {
        const untouched = before && sized.current && before.width === sized.current.width && before.height === sized.current.height;
        sized.current = {width, height};
        return before === undefined ? fresh : untouched ? {...before, width, height} : before;
      });
    }
  }, [inspection]);
  const choose = (next: number) => {
    setChosen(next);
    setCamera('');
    setForm(undefined);
    void inspectAgain(sent!, sent!.choices[next]!, '');
  };
  const submit = async () => {
    const spec = newSpec(inspection!.scene, form!.name);
    const job = await submitter.submit(filledSpec(spec, inspection!.scene, form!, greeting!, 0n));
    window.location.hash = `#/jobs/${job}`;
  };
  return (
    <section class="submit-panel" aria-labelledby="submit-title">
      <h2 id="submit-title">
        Submit a scene <span class="muted">{files.length === 1 ? files[0]!.path : `${files.length} files`}</span>
      </h2>
      {sent && sent.leftOut > 0 && <p class="muted">Left out, because no scene names them: {sent.leftOut === 1 ? '1 file' : `${sent.leftOut} files`}.</p>}
      {progress && <Going progress={progress} onCancel={cancel} />}
      {sent && (
        <div class="scene-choice">
          {sent.choices.length > 1 && (
            <label>
              Scene
              <select value={String(chosen)} onChange={(event) => choose(Number(event.currentTarget.value))}>
                {sent.choices.map((each, i) => (
                  <option key={each[0]} value={String(i)}>
                    {each.join(', ')}
                  </option>
                ))}
              </select>
            </label>
          )}
          {inspection && inspection.cameras.length > 1 && (
            <label>
              Camera
              <select
                value={camera}
                onChange={(event) => {
                  setCamera(event.currentTarget.value);
                  void inspectAgain(sent, scene!, event.currentTarget.value);
                }}
              >
                <option value="">The scene's</option>
                {inspection.cameras.map((each) => (
                  <option key={each} value={each}>
                    {each}
                  </option>
                ))}
              </select>
            </label>
          )}
        </div>
      )}
      {[failure, refusal].filter(Boolean).map((each) => (
        <p class="notice failure" role="alert" key={each}>
          {each}
        </p>
      ))}
      {inspection && form && !progress && !failure && (
        <div class="submit-columns">
          <Findings inspection={inspection} />
          <JobFields form={form} onForm={setForm} />
        </div>
      )}
      <div class="actions">
        {failure && (
          <button type="button" onClick={() => void (sent ? inspectAgain(sent, scene!, camera) : send())}>
            Try again
          </button>
        )}
        {inspection && form && !progress && !failure && <ActionButton label="Submit" primary act={submit} onFailure={setRefusal} />}
        <button type="button" onClick={onClose}>
          Close
        </button>
      </div>
    </section>
  );
}
