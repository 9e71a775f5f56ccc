/** A job's error against the time spent, and its extrapolation. */
import type {Job} from '../wire/lightmill/v1/farm_pb';

export interface CurvePoint {
  /** Seconds of the workers' threads. */
  seconds: number;
  /** relMSE, and the ends of its 95% confidence interval. */
  error: number;
  low: number;
  high: number;
}

export interface ErrorCurve {
  points: CurvePoint[];
  /** The relMSE goal; undefined without an error goal. */
  target: number | undefined;
  /**
   * The point at which the upper end meets the target, if errors fall as 1/seconds. `earliest` and `latest` are the range of `seconds` if
   * the true error may lie anywhere in its interval, and the interval keeps its relative width.
   */
  finish: {seconds: number; error: number; earliest: number; latest: number} | undefined;
  /** Guide lines of slope −1 and −2 through the first point. Errors of independent samples fall with slope −1. */
  guides: {slope: number; from: {seconds: number; error: number}; to: {seconds: number; error: number}}[];
}

function point(seconds: number, relMse: number, halfWidth: number): CurvePoint {
  // A logarithmic axis cannot show a lower end of 0 or less.
  return {seconds, error: relMse, low: Math.max(relMse - halfWidth, relMse / 10), high: relMse + halfWidth};
}

/** Made from the job's history and state. Empty before anything is known. */
export function errorCurve(job: Job): ErrorCurve {
  const points = job.history
    .filter((each) => each.workerSeconds > 0 && (each.error?.relMse ?? 0) > 0)
    .map((each) => point(each.workerSeconds, each.error!.relMse, each.error!.halfWidth));
  const last = points.at(-1);
  if (job.error && job.error.relMse > 0 && job.workerSeconds > (last?.seconds ?? 0)) {
    points.push(point(job.workerSeconds, job.error.relMse, job.error.halfWidth));
  }
  const target = job.goal && job.goal.error > 0 ? job.goal.error : undefined;
  const now = points.at(-1);
  const finish =
    target !== undefined && now !== undefined && now.high > target
      ? finishOf(now, target)
      : undefined;
  return {points, target, finish, guides: points.length > 0 ? guidesFrom(points[0]!, finish?.latest ?? now!.seconds) : []};
}

function finishOf(now: CurvePoint, target: number): ErrorCurve['finish'] {
  const at = (upperEnd: number) => Math.max(now.seconds, (now.seconds * upperEnd) / target);
  return {seconds: at(now.high), error: target, earliest: at(now.error), latest: at(2 * now.high - now.error)};
}

function guidesFrom(first: CurvePoint, lastSeconds: number): ErrorCurve['guides'] {
  const seconds = Math.max(lastSeconds, first.seconds * 10);
  return [-1, -2].map((slope) => ({
    slope,
    from: {seconds: first.seconds, error: first.error},
    to: {seconds, error: first.error * (seconds / first.seconds) ** slope},
  }));
}
