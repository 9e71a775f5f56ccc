/** Lines of errors against time, and their export as CSV. */
import type {CurvePoint} from './error_curve';

export interface ChartLine {
  /** The name of a job, or of a lab's scene. */
  name: string;
  method: string;
  /** A CSS colour. */
  color: string;
  points: readonly CurvePoint[];
}

/** Colours of the lines after the first, visible on light and dark. */
export const kLineColors = ['#3b82f6', '#30a46c', '#e5484d', '#8e4ec6', '#12a594', '#f76b15', '#d6409f'];

/** The point of a line that is nearest to `seconds` on a logarithmic axis. */
export function nearestPoint(points: readonly CurvePoint[], seconds: number): CurvePoint | undefined {
  const distance = (point: CurvePoint) => Math.abs(Math.log(point.seconds / seconds));
  return points.reduce<CurvePoint | undefined>((best, point) => (best && distance(best) <= distance(point) ? best : point), undefined);
}

/** A CSV field, quoted where needed. Text that a spreadsheet would take for a formula stays text. */
function field(text: string): string {
  const safe = /^[=+\-@\t\r]/.test(text) ? `'${text}` : text;
  return /[",\r\n]/.test(safe) ? `"${safe.replaceAll('"', '""')}"` : safe;
}

/** One line per point: thread seconds, relMSE and its 95% interval. */
export function csvOf(lines: readonly ChartLine[]): string {
  const rows = lines.flatMap(({name, method, points}) =>
    points.map((point) => [field(name), field(method), point.seconds, point.error, point.low, point.high].join(',')),
  );
  return ['name,method,thread_seconds,rel_mse,low,high', ...rows].join('\n') + '\n';
}
