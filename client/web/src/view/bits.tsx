/** Small pieces that several pages show. */
import {useEffect, useRef, useState} from 'preact/hooks';
import {ActionError} from '../api/actions';
import {errorText, humanSeconds, stateName} from '../model/format';
import {fractionDone} from '../model/jobs';
import {JobState, type Job} from '../wire/lightmill/v1/farm_pb';

/** For what has just been opened: it is brought into sight, and keys go on there. */
export function useOpened<Element extends HTMLElement>(): {current: Element | null} {
  const opened = useRef<Element>(null);
  useEffect(() => {
    opened.current?.focus({preventScroll: true});
    opened.current?.scrollIntoView({block: 'nearest'});
  }, []);
  return opened;
}

export function StateBadge({state}: {state: JobState}) {
  const name = stateName(state);
  return <span class={`badge state-${name}`}>{name}</span>;
}

/** How far a job is, as a bar with its number. */
export function Progress({job}: {job: Job}) {
  const percent = Math.floor(100 * fractionDone(job));
  return (
    <span class={`progress state-${stateName(job.state)}`}>
      <span class="track" role="progressbar" aria-label={`progress of job ${job.id}`} aria-valuenow={percent} aria-valuemin={0} aria-valuemax={100}>
        <span class="fill" style={{width: `${percent}%`}} />
      </span>
      <span class="number">{percent}%</span>
    </span>
  );
}

/** The frame's error; of a job that asks for one, whether it is still to fall. */
export function ErrorValue({job}: {job: Job}) {
  const text = errorText(job.error?.relMse);
  return <span title={job.error ? `relMSE ${job.error.relMse.toPrecision(3)}` : undefined}>{text || '–'}</span>;
}

/** When a running job is expected to end. */
export function etaText(job: Job): string {
  if (job.state === JobState.RUNNING) {
    return job.etaSeconds >= 0 ? humanSeconds(job.etaSeconds) : '?';
  }
  return '';
}

interface ActionButtonProps {
  label: string;
  /** Asked before it is done. */
  question?: string;
  danger?: boolean;
  /** What the form around it is for. */
  primary?: boolean;
  title?: string;
  /** Why it cannot be done; it is shown, but cannot be pressed. */
  refused?: string;
  act: () => Promise<void>;
  onFailure: (message: string) => void;
}

/** Does something at the coordinator; says what went wrong. */
export function ActionButton({label, question, danger, primary, title, refused, act, onFailure}: ActionButtonProps) {
  const [busy, setBusy] = useState(false);
  const press = async () => {
    if (question && !window.confirm(question)) {
      return;
    }
    setBusy(true);
    onFailure('');
    try {
      await act();
    } catch (error) {
      onFailure(error instanceof ActionError ? error.message : String(error));
    } finally {
      setBusy(false);
    }
  };
  return (
    <button type="button" class={danger ? 'danger' : primary ? 'primary' : ''} disabled={busy || refused !== undefined} title={refused ?? title} onClick={() => void press()}>
      {label}
    </button>
  );
}
