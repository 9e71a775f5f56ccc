/** A region of the picture: its place, and the statistics of its pixels. */
import {useMemo} from 'preact/hooks';
import type {Film, Rect} from '../model/film';
import {humanCount, valueText} from '../model/format';
import {movedRegion, regionStatistics, within, type RegionStatistics, type Spread} from '../model/region';
import {useFilmVersion} from './inspector';
import {NumberField} from './number_field';

const kFields: [keyof Rect, string][] = [
  ['x', 'Left'],
  ['y', 'Top'],
  ['width', 'Width'],
  ['height', 'Height'],
];
const kMeasures: [keyof Spread, string][] = [
  ['mean', 'Mean'],
  ['median', 'Median'],
  ['least', 'Minimum'],
  ['most', 'Maximum'],
  ['variance', 'Variance'],
];

function Statistics({found}: {found: RegionStatistics}) {
  const columns: [string, Spread][] = [
    ['R', found.red],
    ['G', found.green],
    ['B', found.blue],
    ['Lum.', found.luminance],
  ];
  const {samples} = found;
  const perPixel = samples.least === samples.most ? String(samples.least) : `${samples.least} to ${samples.most}`;
  return (
    <>
      <table class="region-table">
        <thead>
          <tr>
            <td />
            {columns.map(([name]) => (
              <th key={name} scope="col">
                {name}
              </th>
            ))}
          </tr>
        </thead>
        <tbody>
          {kMeasures.map(([measure, label]) => (
            <tr key={measure}>
              <th scope="row">{label}</th>
              {columns.map(([name, spread]) => (
                <td key={name}>{valueText(spread[measure])}</td>
              ))}
            </tr>
          ))}
        </tbody>
      </table>
      <dl class="facts">
        <div>
          <dt>Standard error of the mean luminance</dt>
          <dd title="Assumes that the errors of pixels are independent">{found.standardError === undefined ? '–' : `± ${valueText(found.standardError)}`}</dd>
        </div>
        <div>
          <dt>Pixels</dt>
          <dd>{found.pixels}</dd>
        </div>
        <div>
          <dt>Samples</dt>
          <dd>
            {humanCount(samples.total)} ({perPixel} a pixel)
          </dd>
        </div>
      </dl>
    </>
  );
}

export interface RegionPanelProps {
  film: Film | undefined;
  region: Rect;
  onRegion: (region: Rect | undefined) => void;
}

export function RegionPanel({film, region, onRegion}: RegionPanelProps) {
  const version = useFilmVersion(film, 1_000);
  const inside = film && within(region, film.crop);
  const found = useMemo(() => inside && regionStatistics(film, inside), [film, version, inside?.x, inside?.y, inside?.width, inside?.height]);
  const set = (field: keyof Rect, value: number) => {
    if (film && inside) {
      onRegion(movedRegion(inside, {[field]: Math.round(value) - inside[field] - originOf(film, field)}, film.crop));
    }
  };
  return (
    <section class="panel" aria-labelledby="region-title">
      <h2 id="region-title">
        Region{' '}
        <button type="button" class="quiet" aria-label="Remove the region" title="Remove the region (Esc)" onClick={() => onRegion(undefined)}>
          ✕
        </button>
      </h2>
      <div class="region-fields">
        {kFields.map(([field, label]) => (
          <label key={field}>
            {label}
            <NumberField step={1} value={inside && film ? inside[field] + originOf(film, field) : undefined} onValue={(value) => set(field, value)} />
          </label>
        ))}
      </div>
      {found ? <Statistics found={found} /> : <p class="muted">No pixel of the region has samples.</p>}
    </section>
  );
}

/** Places are relative to the frame, and the film may be a crop of it. */
function originOf(film: Film, field: keyof Rect): number {
  return field === 'x' || field === 'y' ? film.crop[field] : 0;
}
