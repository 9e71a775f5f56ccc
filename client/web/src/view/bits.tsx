/** Small components of several pages. */
import {useEffect, useRef, useState} from 'preact/hooks';
import {ActionError} from '../api/actions';
import {boundedErrorText, errorText, humanSeconds, stateName} from '../model/format';
import {fractionDone} from '../model/jobs';
import {JobState, type Job} from '../wire/lightmill/v1/farm_pb';

/** For an element that was just opened: focuses it, and scrolls it into view. */
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

/** A job's progress, as a bar with a number. */
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

/** The frame's error, and for a job with an error goal whether it still has to fall. */
export function ErrorValue({job}: {job: Job}) {
  const text = errorText(job.error?.relMse);
  return <span title={job.error ? `${boundedErrorText(job.error)}, relMSE ${job.error.relMse.toPrecision(3)}` : undefined}>{text || '–'}</span>;
}

/** The expected time until a running job ends. */
export function etaText(job: Job): string {
  if (job.state === JobState.RUNNING) {
    return job.etaSeconds >= 0 ? humanSeconds(job.etaSeconds) : '?';
  }
  return '';
}

interface ActionButtonProps {
  label: string;
  /** Confirmation text. */
  question?: string;
  danger?: boolean;
  /** Whether it is the main action of its form. */
  primary?: boolean;
  title?: string;
  /** Why the action is not allowed. The button is shown, but disabled. */
  refused?: string;
  act: () => Promise<void>;
  onFailure: (message: string) => void;
}

/** Runs an action of the coordinator, and reports its failure. */
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
