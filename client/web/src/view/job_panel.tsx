/** A job's properties, its family, and its actions. */
import type {ComponentChildren} from 'preact';
import {useState} from 'preact/hooks';
import {actOnJob, deleteJob, extendJob, setPriority} from '../api/actions';
import {ageText, boundedErrorText, goalText, humanRate, humanSeconds, kMixed, methodName, samplesText} from '../model/format';
import {childrenOf, hasEnded} from '../model/jobs';
import {kMinPriority, kMaxPriority} from '../model/job_form';
import {refusalOf} from '../model/rights';
import {JobState, type Job} from '../wire/lightmill/v1/farm_pb';
import {ActionButton, etaText} from './bits';
import {NumberField} from './number_field';
import {useFarm} from './store';

/** The goal that extends a job: its error if it has an error goal, else its samples; and the suggested value. */
function offeredGoal(job: Job): {label: string; offer: number; goal: (value: number) => {samples?: number; error?: number}} {
  const error = job.goal?.error ?? 0;
  if (error > 0) {
    const percent = Number((50 * Math.sqrt(error)).toPrecision(2));
    return {label: 'New error, ±% (95%)', offer: percent, goal: (value) => ({error: (value / 100) ** 2})};
  }
  const samples = Number(job.goal?.samples ?? 0n) || Math.max(Number(job.frameSamples), 1);
  return {label: 'New total of samples', offer: 2 * samples, goal: (value) => ({samples: Math.round(value)})};
}

const kTasks: {task: JobTask; label: string; title: string}[] = [
  {task: 'edit', label: 'Edit & render again', title: 'Change camera, materials, lights and settings, and render the result as a new job'},
  {task: 'clone', label: 'Clone', title: 'Submit the same job again, perhaps with another goal'},
];

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
      <ActionButton label="Extend" title="Give the job this goal. A finished job continues." refused={refusalOf(greeting, 'ExtendJob', job.owner)} act={() => extendJob(job.id, goal(Number(text) || offer))} onFailure={onFailure} />
    </form>
  );
}

function Priority({job, onFailure}: {job: Job; onFailure: (message: string) => void}) {
  const {greeting} = useFarm();
  const refused = refusalOf(greeting, 'SetPriority', job.owner);
  const set = (priority: number) => {
    onFailure('');
    setPriority(job.id, Math.round(priority)).catch((error: unknown) => onFailure(error instanceof Error ? error.message : String(error)));
  };
  return (
    <label class="stacked" title={refused ?? 'Jobs with a higher priority go first'}>
      Priority
      <NumberField class="short" step={1} least={kMinPriority} most={kMaxPriority} value={job.priority} disabled={refused !== undefined} onValue={set} />
    </label>
  );
}

async function deleteAndLeave(job: Job): Promise<void> {
  await deleteJob(job.id);
  window.location.hash = '#/jobs';
}

export interface JobActionsProps {
  job: Job;
  /** The open panel; at most one. */
  open: JobTask | undefined;
  onOpen: (task: JobTask | undefined) => void;
}
export type JobTask = 'edit' | 'clone';

function Actions({job, open, onOpen}: JobActionsProps) {
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
        <ActionButton label="Cancel" danger question={`Cancel job ${job.id}? Its picture stays.`} refused={refused('CancelJob')} act={act('cancel')} onFailure={setFailure} />
      )}
      {kTasks.map(({task, label, title}) => (
        <button type="button" key={task} aria-pressed={open === task} disabled={refused('SubmitJob') !== undefined} title={refused('SubmitJob') ?? title} onClick={() => onOpen(open === task ? undefined : task)}>
          {label}
        </button>
      ))}
      {ended && (
        <ActionButton label="Delete" danger question={`Delete job ${job.id} and its picture? This cannot be undone.`} refused={refused('DeleteJob')} act={() => deleteAndLeave(job)} onFailure={setFailure} />
      )}
      {extendable && <Extend job={job} onFailure={setFailure} />}
      {!ended && <Priority job={job} onFailure={setFailure} />}
      {failure && (
        <p class="notice failure" role="alert">
          {failure}
        </p>
      )}
    </div>
  );
}

function JobLink({id}: {id: bigint}) {
  const {jobs} = useFarm();
  const name = jobs.get(id)?.name;
  return (
    <a href={`#/jobs/${id}`}>
      {name} #{String(id)}
    </a>
  );
}

/** The job's parent and children. */
function Family({job}: {job: Job}) {
  const {jobs} = useFarm();
  const children = childrenOf(jobs, job.id);
  return (
    <>
      {job.parent > 0n && (
        <div>
          <dt>Parent</dt>
          <dd>
            <JobLink id={job.parent} />
          </dd>
        </div>
      )}
      {children.length > 0 && (
        <div>
          <dt>Children</dt>
          <dd class="family">
            {children.map((id) => (
              <JobLink key={String(id)} id={id} />
            ))}
          </dd>
        </div>
      )}
    </>
  );
}

function Facts({job}: {job: Job}) {
  const rows: [string, string][] = [
    ['Goal', goalText(job)],
    ['Samples', samplesText(job)],
    ['Error', boundedErrorText(job.error) || '–'],
    ['Speed', job.state === JobState.RUNNING ? humanRate(job.samplesPerSecond) : '–'],
    ['ETA', etaText(job) || '–'],
    ['Rendering time', `${humanSeconds(job.activeSeconds)} (${humanSeconds(job.workerSeconds)} of thread time)`],
    ['Method', methodName(job)],
    ['Size', `${job.width}×${job.height}`],
    ['Owner', job.owner ? `${job.owner}${job.host ? ` on ${job.host}` : ''}` : '–'],
    ['Priority', String(job.priority)],
    ['Submitted', ageText(Number(job.submittedUnixMs), Date.now())],
    ['Class', job.allowMixed ? `mixed. ${kMixed}.` : job.fingerprintClass.slice(0, 16) || '–'],
  ];
  return (
    <dl class="facts">
      {rows.map(([name, value]) => (
        <div key={name}>
          <dt>{name}</dt>
          <dd>{value}</dd>
        </div>
      ))}
      <Family job={job} />
    </dl>
  );
}

/** `children`: the open panel. */
export function JobPanel({children, ...actions}: JobActionsProps & {children?: ComponentChildren}) {
  return (
    <section class="panel" aria-labelledby="facts-title">
      <h2 id="facts-title">Job</h2>
      <Facts job={actions.job} />
      <Actions {...actions} />
      {children}
    </section>
  );
}
