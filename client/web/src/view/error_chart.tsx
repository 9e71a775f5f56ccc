/** The job's error against the time spent, beside that of other jobs, on log-log axes. */
import {useEffect, useRef, useState} from 'preact/hooks';
import uPlot from 'uplot';
import 'uplot/dist/uPlot.min.css';
import {csvOf, kLineColors, nearestPoint, type ChartLine} from '../model/chart';
import {errorCurve, type ErrorCurve} from '../model/error_curve';
import {errorText, humanSeconds, methodName, powerOfTen, valueText} from '../model/format';
import {hasEnded} from '../model/jobs';
import {kMaxCharted} from '../model/route';
import type {Job} from '../wire/lightmill/v1/farm_pb';
import {useChartedJobs} from './charted_jobs';
import {save} from './download';
import {useFarm} from './store';

/** Number of columns before those of other jobs. */
const kOwnColumns = 9;

/**
 * Columns: seconds; error, low, high, target, the extrapolated upper end, the earliest and latest extrapolation, the guides of slope −1 and
 * −2; then the errors of other jobs.
 */
function columnsOf(curve: ErrorCurve, others: readonly ChartLine[]): uPlot.AlignedData {
  const rows = new Map<number, (number | null)[]>();
  const width = kOwnColumns + others.length;
  const put = (seconds: number, column: number, value: number) => {
    const row = rows.get(seconds) ?? Array<number | null>(width).fill(null);
    row[column] = value;
    rows.set(seconds, row);
  };
  for (const point of curve.points) {
    put(point.seconds, 0, point.error);
    put(point.seconds, 1, point.low);
    put(point.seconds, 2, point.high);
  }
  const [first, last] = [curve.points[0], curve.points.at(-1)];
  if (first && last) {
    const end = curve.guides[0]?.to.seconds ?? last.seconds;
    if (curve.target !== undefined) {
      put(first.seconds, 3, curve.target);
      put(end, 3, curve.target);
    }
    if (curve.finish) {
      const {seconds, latest, error} = curve.finish;
      put(last.seconds, 4, last.high);
      put(seconds, 4, error);
      // Two lines of slope −1 with the same end, because the area between them is filled.
      put(last.seconds, 5, last.error);
      put(latest, 5, (last.error * last.seconds) / latest);
      put(last.seconds, 6, 2 * last.high - last.error);
      put(latest, 6, error);
    }
    curve.guides.forEach((guide, i) => {
      put(guide.from.seconds, 7 + i, guide.from.error);
      put(guide.to.seconds, 7 + i, guide.to.error);
    });
  }
  others.forEach((line, i) => line.points.forEach((point) => put(point.seconds, kOwnColumns + i, point.error)));
  const seconds = [...rows.keys()].sort((a, b) => a - b);
  const column = (i: number) => seconds.map((at) => rows.get(at)![i]!);
  return [seconds, ...Array.from({length: width}, (_, i) => column(i))] as uPlot.AlignedData;
}

function css(name: string): string {
  return getComputedStyle(document.documentElement).getPropertyValue(name).trim();
}

function optionsFor(width: number, others: readonly ChartLine[], onHover: (seconds: number | undefined) => void): uPlot.Options {
  const line = css('--line');
  const ink = css('--ink-2');
  const axis = {stroke: ink, grid: {stroke: line, width: 1}, ticks: {stroke: line, width: 1}, font: '11px system-ui', values: (_: uPlot, at: (number | null)[]) => at.map(powerOfTen)};
  const accent = css('--accent');
  const dashed = {points: {show: false}, spanGaps: true, width: 1};
  return {
    width,
    height: 220,
    padding: [8, 22, 0, 0],
    legend: {show: false},
    cursor: {drag: {x: false, y: false}},
    scales: {x: {time: false, distr: 3}, y: {distr: 3}},
    axes: [
      {...axis, label: 'thread seconds', labelSize: 18, labelFont: '11px system-ui', size: 30},
      {...axis, label: 'relMSE', labelSize: 18, labelFont: '11px system-ui', size: 56},
    ],
    bands: [
      {series: [3, 2], fill: `${accent}26`},
      {series: [7, 6], fill: `${accent}18`},
    ],
    hooks: {
      setCursor: [(chart) => onHover((chart.cursor.left ?? -1) < 0 ? undefined : chart.posToVal(chart.cursor.left!, 'x'))],
    },
    series: [
      {},
      {label: 'error', stroke: accent, width: 2, spanGaps: true, points: {show: true, size: 5}},
      {label: 'low', ...dashed, width: 0},
      {label: 'high', ...dashed, width: 0},
      {label: 'target', stroke: css('--good'), ...dashed, width: 1.5},
      {label: 'finish', stroke: accent, dash: [5, 4], ...dashed, width: 1.5},
      {label: 'earliest', ...dashed, width: 0},
      {label: 'latest', ...dashed, width: 0},
      {label: 'slope −1', stroke: ink, dash: [2, 4], ...dashed},
      {label: 'slope −2', stroke: ink, dash: [1, 5], ...dashed},
      ...others.map(({name, color}) => ({label: name, stroke: color, width: 2, spanGaps: true, points: {show: true, size: 5}})),
    ],
  };
}

function describe(curve: ErrorCurve, job: Job): string {
  const now = curve.points.at(-1);
  if (!now) {
    return 'The error is known once every tile has samples in both halves.';
  }
  const target = curve.target === undefined ? '' : `, target ${errorText(curve.target)}`;
  const eta = job.etaSeconds >= 0 && !hasEnded(job.state) ? `, expected in ${humanSeconds(job.etaSeconds)}` : '';
  const finish = curve.finish && !hasEnded(job.state) ? `, after ${humanSeconds(curve.finish.earliest)} to ${humanSeconds(curve.finish.latest)} of thread time` : '';
  return `${errorText(now.error)} after ${humanSeconds(now.seconds)} of thread time${target}${eta}${finish}`;
}

function lineOf(job: Job, color: string): ChartLine {
  return {name: job.name ? `${job.name} #${job.id}` : `#${job.id}`, method: methodName(job), color, points: errorCurve(job).points};
}

export interface ErrorChartProps {
  job: Job;
  theme: string;
  /** Other jobs in the same chart. */
  charted: readonly bigint[];
  onCharted: (jobs: bigint[]) => void;
}

export function ErrorChart({job, theme, charted, onCharted}: ErrorChartProps) {
  const curve = errorCurve(job);
  const text = describe(curve, job);
  const [others, failure] = useChartedJobs(charted);
  const lines = [lineOf(job, css('--accent')), ...others.map((other, i) => lineOf(other, kLineColors[i]!))];
  const [hover, setHover] = useState<number>();
  if (lines.every((line) => line.points.length === 0)) {
    return <p class="muted">{text}</p>;
  }
  return (
    <figure class="chart">
      <Plot curve={curve} others={lines.slice(1)} text={text} theme={theme} onHover={setHover} />
      <figcaption>
        {text}
        <span class="keys">
          <span class="key band">95% confidence</span>
          {curve.target !== undefined && <span class="key target">target</span>}
          {curve.finish && <span class="key finish">extrapolation</span>}
          <span class="key guide">slopes −1, −2</span>
        </span>
        <LineList lines={lines} hover={hover} label="Jobs in the chart" onRemove={(i) => onCharted(charted.filter((id) => id !== others[i - 1]!.id))} />
        {failure && (
          <p class="notice failure" role="alert">
            {failure}
          </p>
        )}
        <div class="chart-actions">
          <AddJob job={job} charted={charted} onCharted={onCharted} />
          <CsvButton lines={lines} name={`job-${job.id}-error`} />
        </div>
      </figcaption>
    </figure>
  );
}

export interface LineListProps {
  lines: readonly ChartLine[];
  /** Seconds below the pointer. */
  hover: number | undefined;
  label: string;
  /** For jobs after the first. Left out if the lines are a lab's methods. */
  onRemove?: (line: number) => void;
}

export function LineList({lines, hover, label, onRemove}: LineListProps) {
  return (
    <ul class="chart-lines" aria-label={label}>
      {lines.map((line, i) => (
        <li key={`${line.name} ${line.method}`} style={{borderColor: line.color}}>
          <span class="chart-name">
            {onRemove ? line.name : line.method} <span class="muted">{onRemove && line.method}</span>
          </span>
          <span class="chart-value">{hover === undefined ? '' : hoverText(line, hover)}</span>
          {onRemove && i > 0 && (
            <button type="button" class="quiet" aria-label={`Remove ${line.name} from the chart`} onClick={() => onRemove(i)}>
              ✕
            </button>
          )}
        </li>
      ))}
    </ul>
  );
}

export function CsvButton({lines, name}: {lines: readonly ChartLine[]; name: string}) {
  return (
    <button type="button" onClick={() => save(new Blob([csvOf(lines)], {type: 'text/csv'}), `${name}.csv`)}>
      CSV
    </button>
  );
}

/** The point of a line that is nearest to `seconds`, as text. */
function hoverText({points}: ChartLine, seconds: number): string {
  const point = nearestPoint(points, seconds);
  const time = (at: number) => (at < 1 ? `${at.toPrecision(2)} s` : humanSeconds(at));
  return point ? `${valueText(point.error)} at ${time(point.seconds)}` : '–';
}

function AddJob({job, charted, onCharted}: {job: Job; charted: readonly bigint[]; onCharted: (jobs: bigint[]) => void}) {
  const {jobs} = useFarm();
  const offered = [...jobs.values()].filter((each) => each.id !== job.id && !charted.includes(each.id)).sort((a, b) => Number(b.id - a.id));
  return (
    <select
      aria-label="Add a job to the chart"
      value=""
      disabled={offered.length === 0 || charted.length >= kMaxCharted}
      onChange={(event) => {
        const chosen = event.currentTarget.value;
        event.currentTarget.value = '';
        if (chosen) {
          onCharted([...charted, BigInt(chosen)]);
        }
      }}
    >
      <option value="">Add a job…</option>
      {offered.map((each) => (
        <option key={String(each.id)} value={String(each.id)}>
          {`#${each.id} ${each.name} (${methodName(each)})`}
        </option>
      ))}
    </select>
  );
}

export interface PlotProps {
  curve: ErrorCurve;
  others: readonly ChartLine[];
  text: string;
  theme: string;
  /** Seconds below the pointer. */
  onHover: (seconds: number | undefined) => void;
}

export function Plot({curve, others, text, theme, onHover}: PlotProps) {
  const place = useRef<HTMLDivElement>(null);
  const chart = useRef<uPlot>();
  const data = columnsOf(curve, others);
  const hover = useRef(onHover);
  hover.current = onHover;
  const step = useRef<number>();
  const lines = others.map(({name, method}) => `${name} ${method}`).join('\n');
  useEffect(() => {
    const element = place.current!;
    const made = new uPlot(optionsFor(element.clientWidth, others, (seconds) => hover.current(seconds)), data, element);
    chart.current = made;
    const observer = new ResizeObserver(() => made.setSize({width: element.clientWidth, height: 220}));
    observer.observe(element);
    return () => {
      observer.disconnect();
      made.destroy();
    };
  }, [theme, lines]);
  useEffect(() => chart.current?.setData(data));
  const onKey = (event: KeyboardEvent) => {
    const by = {ArrowLeft: -1, ArrowRight: 1}[event.key];
    const known = [curve, ...others].flatMap(({points}) => points.map((point) => point.seconds)).sort((a, b) => a - b);
    const shown = chart.current;
    if (shown && by !== undefined && known.length > 0) {
      event.preventDefault();
      step.current = Math.min(Math.max((step.current ?? (by > 0 ? -1 : known.length)) + by, 0), known.length - 1);
      shown.setCursor({left: shown.valToPos(known[step.current]!, 'x'), top: 10});
    }
  };
  return <div ref={place} role="img" tabIndex={0} aria-label={`Error against time: ${text}. Arrow keys move between points.`} onKeyDown={onKey} />;
}
