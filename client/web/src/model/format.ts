/** Numbers and words for people, as in the command line. */
import {GoalLimit, JobState, type Job} from '../wire/lightmill/v1/farm_pb';

/** The two largest units: "0.4 s", "3 min 05 s", "2 h 03 min"; "?" for negative (unknown) times. */
export function humanSeconds(seconds: number): string {
  if (!(seconds >= 0) || seconds > 1e15) {
    return '?';
  }
  if (seconds < 9.95) {
    return `${seconds.toFixed(1)} s`;
  }
  const whole = Math.round(seconds);
  const pad = (n: number) => String(n).padStart(2, '0');
  const days = Math.floor(whole / 86400);
  const hours = Math.floor(whole / 3600) % 24;
  const minutes = Math.floor(whole / 60) % 60;
  if (whole < 60) {
    return `${whole} s`;
  }
  if (days > 0) {
    return `${days} d ${pad(hours)} h`;
  }
  return hours > 0 ? `${hours} h ${pad(minutes)} min` : `${minutes} min ${pad(whole % 60)} s`;
}

/** Three significant digits and a metric prefix: "950", "1.23 k", "45.6 M". */
export function humanCount(count: number): string {
  if (!Number.isFinite(count) || count < 0) {
    return '?';
  }
  if (count < 999.5) {
    return Number.isInteger(count) ? String(count) : threeDigits(count);
  }
  const prefixes = ['k', 'M', 'G', 'T', 'P', 'E'];
  let prefix = 0;
  for (count /= 1000; count >= 999.5 && prefix + 1 < prefixes.length; count /= 1000) {
    ++prefix;
  }
  return `${threeDigits(count)} ${prefixes[prefix]}`;
}

function threeDigits(value: number): string {
  return value.toFixed(value < 9.995 ? 2 : value < 99.95 ? 1 : 0);
}

/** The same for a tick, without trailing zeros: "0", "2.5 M". */
export function tickText(count: number): string {
  const [digits, ...prefix] = humanCount(count).split(' ');
  return [Number(digits), ...prefix].join(' ');
}

/** "1 thread", "2 threads", "1.23 k results". */
export function counted(number: number, noun: string): string {
  return `${humanCount(number)} ${noun}${number === 1 ? '' : 's'}`;
}

export function humanRate(samplesPerSecond: number): string {
  const text = humanCount(samplesPerSecond);
  return /[kMGTPE]$/.test(text) ? `${text}samples/s` : `${text} samples/s`;
}

/** "±1.2%", "±12%": √relMSE; empty while it is unknown. */
export function errorText(relMse: number | undefined): string {
  if (relMse === undefined) {
    return '';
  }
  const percent = 100 * Math.sqrt(Math.max(relMse, 0));
  return percent >= 9.95 ? `±${percent.toFixed(0)}%` : `±${percent.toPrecision(2)}%`;
}

/** "±1.2% (95%: at most ±1.3%)": the estimate, and the upper end of its 95% confidence interval. Empty while it is unknown. */
export function boundedErrorText(error: {relMse: number; halfWidth: number} | undefined): string {
  return error ? `${errorText(error.relMse)} (95%: at most ${errorText(error.relMse + error.halfWidth)})` : '';
}

/** A pixel's value in five significant digits. */
export function valueText(value: number): string {
  if (!Number.isFinite(value)) {
    return String(value);
  }
  const size = Math.abs(value);
  return size !== 0 && (size < 1e-3 || size >= 1e5) ? value.toExponential(3) : value.toPrecision(4);
}

/** A tick of a logarithmic axis: whole powers of ten. Other values, and null (no room), have no label. */
export function powerOfTen(value: number | null): string {
  const exponent = value === null ? NaN : Math.log10(value);
  const whole = Math.round(exponent);
  if (value === null || !(Math.abs(exponent - whole) < 1e-6)) {
    return '';
  }
  return whole < -4 || whole > 5 ? `1e${whole}` : String(Number(value.toPrecision(1)));
}

const kStates: Record<JobState, string> = {
  [JobState.UNSPECIFIED]: 'unknown',
  [JobState.QUEUED]: 'queued',
  [JobState.RUNNING]: 'running',
  [JobState.PAUSED]: 'paused',
  [JobState.DONE]: 'done',
  [JobState.FAILED]: 'failed',
  [JobState.CANCELLED]: 'cancelled',
};

export function stateName(state: JobState): string {
  return kStates[state] ?? 'unknown';
}

/** The limit that ended a job. */
export function reachedName(limit: GoalLimit): string {
  return {[GoalLimit.SAMPLES]: 'samples', [GoalLimit.SECONDS]: 'time', [GoalLimit.ERROR]: 'error'}[limit as number] ?? '';
}

/** "path"; or the candidates, while a pilot has not chosen. */
export function methodName(job: Job): string {
  const candidates = job.methodNotes?.candidates ?? [];
  return candidates.length > 0 ? candidates.join(' or ') : job.method;
}

/** A warning for a job that allows mixed fingerprint classes. */
export const kMixed = 'Workers of every fingerprint class may render it. If they round differently, its bits cannot be reproduced';

/** "64 samples or ±1.0% or 2 min 00 s". */
export function goalText(job: Job): string {
  const parts: string[] = [];
  if (job.goal?.samples) {
    parts.push(`${job.goal.samples} ${job.goal.samples === 1n ? 'sample' : 'samples'}`);
  }
  if (job.goal?.error) {
    parts.push(errorText(job.goal.error));
  }
  if (job.goal?.seconds) {
    parts.push(humanSeconds(job.goal.seconds));
  }
  return parts.join(' or ');
}

/** "12/64", or "12" without a sample goal. */
export function samplesText(job: Job): string {
  const wanted = job.goal?.samples ?? 0n;
  return wanted > 0n ? `${job.frameSamples}/${wanted}` : String(job.frameSamples);
}

function dateText(time: Date): string {
  return time.toLocaleDateString('en-GB', {day: 'numeric', month: 'short'});
}

/** A tick of a time axis in Unix seconds, in local time: "14:05"; at midnight the new day, "24 Nov". */
export function clockTick(seconds: number): string {
  const time = new Date(1000 * seconds);
  const pad = (n: number) => String(n).padStart(2, '0');
  return time.getHours() + time.getMinutes() === 0 ? dateText(time) : `${pad(time.getHours())}:${pad(time.getMinutes())}`;
}

/** A time in Unix milliseconds, in local time: "14:05:09" on the day of `nowMs`, else "23 Nov 14:05:09". */
export function momentText(unixMs: number, nowMs: number): string {
  const time = new Date(unixMs);
  const clock = time.toLocaleTimeString('en-GB');
  return time.toDateString() === new Date(nowMs).toDateString() ? clock : `${dateText(time)} ${clock}`;
}

/** "just now" or "5 min ago", for a Unix time in milliseconds. */
export function ageText(unixMs: number, nowMs: number): string {
  const seconds = (nowMs - unixMs) / 1000;
  if (unixMs === 0) {
    return '';
  }
  if (seconds < 60) {
    return 'just now';
  }
  if (seconds < 3600) {
    return `${Math.floor(seconds / 60)} min ago`;
  }
  return seconds < 86400 ? `${Math.floor(seconds / 3600)} h ago` : `${Math.floor(seconds / 86400)} d ago`;
}
