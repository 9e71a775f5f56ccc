/** Lines over time, with a cursor for mouse and arrow keys. */
import {useEffect, useRef} from 'preact/hooks';
import uPlot from 'uplot';
import 'uplot/dist/uPlot.min.css';
import {lonely, type Column, type TimeWindow} from '../model/farm_history';
import {clockTick, tickText} from '../model/format';

const kHeight = 120;
/** Possible distances between ticks, in seconds: whole minutes that divide hours or days. */
const kTimeSteps = [1, 2, 5, 10, 15, 30, 60, 120, 180, 240, 360, 720, 1440].map((minutes) => 60 * minutes);
const kWholeSteps = [1, 10, 100, 1e3, 1e4, 1e5, 1e6].flatMap((power) => [power, 2 * power, 5 * power]);

export interface TimeLine {
  name: string;
  /** A CSS variable, e.g. "--accent". */
  color: string;
  filled?: boolean;
  /** Makes the line distinguishable without colour. */
  dashed?: boolean;
  values: Column;
}

export interface TimePlotProps {
  times: readonly number[];
  lines: readonly TimeLine[];
  window: TimeWindow;
  /** Ticks are whole numbers. */
  whole?: boolean;
  /** Plots with the same name share a cursor. */
  together: string;
  /** For screen readers. */
  label: string;
  theme: string;
  /** The index in `times` below the pointer. */
  onHover: (at: number | undefined) => void;
}

function css(name: string): string {
  return getComputedStyle(document.documentElement).getPropertyValue(name).trim();
}

function seriesFor({name, color, filled, dashed}: TimeLine): uPlot.Series {
  return {
    label: name,
    stroke: css(color),
    width: 2,
    dash: dashed ? [6, 4] : undefined,
    fill: filled ? `${css(color)}26` : undefined,
    spanGaps: false,
    points: {show: false, size: 5, fill: css(color), filter: (chart, at) => lonely(chart.data[at] as Column)},
  };
}

function optionsFor(width: number, props: () => TimePlotProps): uPlot.Options {
  const {lines, whole, together} = props();
  const line = css('--line');
  const axis = {stroke: css('--ink-2'), grid: {stroke: line, width: 1}, ticks: {stroke: line, width: 1}, font: '11px system-ui'};
  return {
    width,
    height: kHeight,
    padding: [8, 18, 0, 0],
    legend: {show: false},
    cursor: {drag: {x: false, y: false}, sync: {key: together}},
    scales: {
      x: {time: true, range: () => [...props().window]},
      y: {range: (_, __, most) => [0, most > 0 ? 1.1 * most : 1]},
    },
    axes: [
      {...axis, size: 28, incrs: kTimeSteps, values: (_, at) => at.map(clockTick)},
      {...axis, size: 48, incrs: whole ? kWholeSteps : undefined, values: (_, at) => at.map(tickText)},
    ],
    hooks: {setCursor: [(made) => props().onHover(made.cursor.idx ?? undefined)]},
    series: [{}, ...lines.map(seriesFor)],
  };
}

export function TimePlot(props: TimePlotProps) {
  const {times, lines, label, theme} = props;
  const place = useRef<HTMLDivElement>(null);
  const chart = useRef<uPlot>();
  const latest = useRef(props);
  latest.current = props;
  const step = useRef<number>();
  useEffect(() => {
    const element = place.current!;
    const made = new uPlot(optionsFor(element.clientWidth, () => latest.current), [[]], element);
    chart.current = made;
    const observer = new ResizeObserver(() => made.setSize({width: element.clientWidth, height: kHeight}));
    observer.observe(element);
    return () => {
      observer.disconnect();
      made.destroy();
    };
  }, [theme, lines.map(({name}) => name).join()]);
  useEffect(() => chart.current?.setData([times, ...lines.map(({values}) => values)] as uPlot.AlignedData), [times, theme]);
  const onKey = (event: KeyboardEvent) => {
    const by = {ArrowLeft: -1, ArrowRight: 1}[event.key];
    const shown = chart.current;
    if (shown && by !== undefined && times.length > 0) {
      event.preventDefault();
      step.current = Math.min(Math.max((step.current ?? (by > 0 ? -1 : times.length)) + by, 0), times.length - 1);
      shown.setCursor({left: shown.valToPos(times[step.current]!, 'x'), top: 10});
    }
  };
  const onBlur = () => {
    step.current = undefined;
    chart.current?.setCursor({left: -10, top: -10});
  };
  return (
    <div ref={place} class="time-plot" role="img" tabIndex={0} aria-label={`${label} Arrow keys move the cursor.`} onKeyDown={onKey} onBlur={onBlur} />
  );
}
