/** The job's error against the work spent on it, on log-log axes. */
import {useEffect, useRef} from 'preact/hooks';
import uPlot from 'uplot';
import 'uplot/dist/uPlot.min.css';
import {errorCurve, type ErrorCurve} from '../model/error_curve';
import {errorText, humanSeconds, powerOfTen} from '../model/format';
import type {Job} from '../wire/lightmill/v1/farm_pb';

/** Columns: seconds, error, low, high, target, the way to the finish, and the guides of slope −1 and −2. */
function columnsOf(curve: ErrorCurve): uPlot.AlignedData {
  const rows = new Map<number, (number | null)[]>();
  const put = (seconds: number, column: number, value: number) => {
    const row = rows.get(seconds) ?? Array<number | null>(7).fill(null);
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
      put(last.seconds, 4, last.high);
      put(curve.finish.seconds, 4, curve.finish.error);
    }
    curve.guides.forEach((guide, i) => {
      put(guide.from.seconds, 5 + i, guide.from.error);
      put(guide.to.seconds, 5 + i, guide.to.error);
    });
  }
  const seconds = [...rows.keys()].sort((a, b) => a - b);
  const column = (i: number) => seconds.map((at) => rows.get(at)![i]!);
  return [seconds, ...[0, 1, 2, 3, 4, 5, 6].map(column)] as uPlot.AlignedData;
}

function css(name: string): string {
  return getComputedStyle(document.documentElement).getPropertyValue(name).trim();
}

function optionsFor(width: number): uPlot.Options {
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
    bands: [{series: [3, 2], fill: `${accent}26`}],
    series: [
      {},
      {label: 'error', stroke: accent, width: 2, spanGaps: true, points: {show: true, size: 5}},
      {label: 'low', ...dashed, width: 0},
      {label: 'high', ...dashed, width: 0},
      {label: 'target', stroke: css('--good'), ...dashed, width: 1.5},
      {label: 'finish', stroke: accent, dash: [5, 4], ...dashed, width: 1.5},
      {label: 'slope −1', stroke: ink, dash: [2, 4], ...dashed},
      {label: 'slope −2', stroke: ink, dash: [1, 5], ...dashed},
    ],
  };
}

function describe(curve: ErrorCurve, job: Job): string {
  const now = curve.points.at(-1);
  if (!now) {
    return 'The error is known once every tile has samples in both halves.';
  }
  const target = curve.target === undefined ? '' : `, target ${errorText(curve.target)}`;
  const eta = job.etaSeconds >= 0 ? `, expected in ${humanSeconds(job.etaSeconds)}` : '';
  return `${errorText(now.error)} after ${humanSeconds(now.seconds)} of threads${target}${eta}`;
}

export function ErrorChart({job, theme}: {job: Job; theme: string}) {
  const curve = errorCurve(job);
  const text = describe(curve, job);
  if (curve.points.length === 0) {
    return <p class="muted">{text}</p>;
  }
  return (
    <figure class="chart">
      <Plot curve={curve} text={text} theme={theme} />
      <figcaption>
        {text}
        <span class="keys">
          <span class="key band">95 %</span>
          {curve.target !== undefined && <span class="key target">target</span>}
          {curve.finish && <span class="key finish">to the target</span>}
          <span class="key guide">slopes −1, −2</span>
        </span>
      </figcaption>
    </figure>
  );
}

function Plot({curve, text, theme}: {curve: ErrorCurve; text: string; theme: string}) {
  const place = useRef<HTMLDivElement>(null);
  const chart = useRef<uPlot>();
  const data = columnsOf(curve);
  useEffect(() => {
    const element = place.current!;
    const made = new uPlot(optionsFor(element.clientWidth), data, element);
    chart.current = made;
    const observer = new ResizeObserver(() => made.setSize({width: element.clientWidth, height: 220}));
    observer.observe(element);
    return () => {
      observer.disconnect();
      made.destroy();
    };
  }, [theme]);
  useEffect(() => chart.current?.setData(data));
  return <div ref={place} role="img" aria-label={`Error against time: ${text}`} />;
}
