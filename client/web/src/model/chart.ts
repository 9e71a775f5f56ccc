/** Exports of errors against time on log-log axes: CSV, and stand-alone SVG. */
import type {CurvePoint} from './error_curve';

export interface ChartLine {
  /** The name of a job, or of a lab's scene. */
  name: string;
  method: string;
  /** A CSS colour. */
  color: string;
  points: readonly CurvePoint[];
}

export interface Chart {
  lines: readonly ChartLine[];
  /** relMSE; undefined: none. */
  target: number | undefined;
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

/** One line per point: thread seconds, relMSE and its 95 % interval. */
export function csvOf({lines}: Chart): string {
  const rows = lines.flatMap(({name, method, points}) =>
    points.map((point) => [field(name), field(method), point.seconds, point.error, point.low, point.high].join(',')),
  );
  return ['name,method,thread_seconds,rel_mse,low,high', ...rows].join('\n') + '\n';
}

const kWidth = 640;
const kPlot = {left: 70, top: 20, right: 620, bottom: 360};
const kRowHeight = 18;

/** The whole decades that contain all values, at least one. */
function decades(values: readonly number[]): [number, number] {
  const low = Math.floor(Math.log10(Math.min(...values)) + 1e-9);
  const high = Math.ceil(Math.log10(Math.max(...values)) - 1e-9);
  return [low, Math.max(high, low + 1)];
}

function xml(text: string): string {
  const allowed = text.replace(/[\u0000-\u0008\u000b\u000c\u000e-\u001f]/g, ' ');
  return allowed.replaceAll('&', '&amp;').replaceAll('<', '&lt;').replaceAll('>', '&gt;').replaceAll('"', '&quot;');
}

/** Empty if no line has points. */
export function svgOf({lines, target}: Chart): string {
  const points = lines.flatMap((line) => line.points);
  if (points.length === 0) {
    return '';
  }
  const [x0, x1] = decades(points.map((point) => point.seconds));
  const [y0, y1] = decades([...points.flatMap((point) => [point.low, point.high]), ...(target === undefined ? [] : [target])]);
  const x = (seconds: number) => (kPlot.left + ((Math.log10(seconds) - x0) / (x1 - x0)) * (kPlot.right - kPlot.left)).toFixed(2);
  const y = (error: number) => (kPlot.bottom - ((Math.log10(error) - y0) / (y1 - y0)) * (kPlot.bottom - kPlot.top)).toFixed(2);
  const exponents = (from: number, to: number) => Array.from({length: to - from + 1}, (_, i) => from + i);
  const out: string[] = [];
  for (const exponent of exponents(x0, x1)) {
    const at = x(10 ** exponent);
    out.push(`<path d="M${at} ${kPlot.top}V${kPlot.bottom}" stroke="#ccc"/>`);
    out.push(`<text x="${at}" y="${kPlot.bottom + 16}" text-anchor="middle">1e${exponent}</text>`);
  }
  for (const exponent of exponents(y0, y1)) {
    const at = y(10 ** exponent);
    out.push(`<path d="M${kPlot.left} ${at}H${kPlot.right}" stroke="#ccc"/>`);
    out.push(`<text x="${kPlot.left - 6}" y="${Number(at) + 4}" text-anchor="end">1e${exponent}</text>`);
  }
  if (target !== undefined) {
    out.push(`<path d="M${kPlot.left} ${y(target)}H${kPlot.right}" stroke="#18794e" stroke-dasharray="4 3"><title>target</title></path>`);
  }
  lines.forEach(({name, method, color, points: line}, i) => {
    const stroke = xml(color);
    const along = line.map((point) => `${x(point.seconds)},${y(point.error)}`);
    const band = [...line.map((point) => `${x(point.seconds)},${y(point.high)}`), ...[...line].reverse().map((point) => `${x(point.seconds)},${y(point.low)}`)];
    out.push(`<polygon points="${band.join(' ')}" fill="${stroke}" fill-opacity="0.15"/>`);
    out.push(`<polyline points="${along.join(' ')}" fill="none" stroke="${stroke}" stroke-width="2"/>`);
    out.push(...along.map((at) => `<circle cx="${at.split(',')[0]}" cy="${at.split(',')[1]}" r="2.5" fill="${stroke}"/>`));
    const row = kPlot.bottom + 54 + kRowHeight * i;
    out.push(`<path d="M${kPlot.left} ${row - 4}h20" stroke="${stroke}" stroke-width="3"/>`);
    out.push(`<text x="${kPlot.left + 28}" y="${row}">${xml(`${name} (${method})`)}</text>`);
  });
  out.push(`<text x="${(kPlot.left + kPlot.right) / 2}" y="${kPlot.bottom + 34}" text-anchor="middle">thread seconds</text>`);
  out.push(`<text x="16" y="${kPlot.top - 6}">relMSE</text>`);
  const height = kPlot.bottom + 62 + kRowHeight * lines.length;
  return [
    `<svg xmlns="http://www.w3.org/2000/svg" width="${kWidth}" height="${height}" viewBox="0 0 ${kWidth} ${height}" font-family="sans-serif" font-size="12" fill="#222">`,
    `<rect width="${kWidth}" height="${height}" fill="#fff"/>`,
    ...out,
    '</svg>\n',
  ].join('\n');
}
