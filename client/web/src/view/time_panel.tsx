/** A chart over time with its title, and the lines' values at the pointer, or the last ones. */
import type {ComponentChildren} from 'preact';
import type {Column} from '../model/farm_history';
import {momentText} from '../model/format';
import {TimePlot, type TimePlotProps} from './time_plot';

export interface TimePanelProps extends Omit<TimePlotProps, 'label'> {
  title: string;
  write: (value: number) => string;
  /** The index in `times` below the pointer. */
  at: number | undefined;
  children?: ComponentChildren;
}

export function TimePanel({title, write, at, children, ...plot}: TimePanelProps) {
  const {times, lines} = plot;
  const value = (column: Column) => {
    const found = at === undefined ? column.at(-1) : column[at];
    return found === null || found === undefined ? '–' : write(found);
  };
  const moment = at !== undefined && times[at] !== undefined ? momentText(1000 * times[at], Date.now()) : '';
  const said = lines.map(({name, values}) => `${name} ${value(values)}`).join(', ');
  return (
    <figure class="farm-chart">
      <figcaption>
        <span>
          <strong>{title}</strong>
          {children}
        </span>
        <span class="keys">
          {moment}
          {lines.map(({name, color, dashed, values}) => (
            <span key={name} class={`line-key ${dashed ? 'dashed' : ''}`} style={{'--key': `var(${color})`}}>
              {name} <b>{value(values)}</b>
            </span>
          ))}
        </span>
      </figcaption>
      <TimePlot {...plot} label={`${title}${moment && `, ${moment}`}: ${said}.`} />
    </figure>
  );
}
