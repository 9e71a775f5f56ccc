/** Display settings of the picture: exposure, maps and comparisons. */
import type {Film} from '../model/film';
import {layerLabel} from '../model/layers';
import {kMaxGamma, kMaxStops, type DisplaySettings, type Photons, type Show} from '../model/route';
import {CompareControls, type CompareControlsProps} from './compare_panel';
import {legendOf} from './gl_picture';
import {useFilmVersion} from './inspector';
import {NumberField} from './number_field';

const kShowLabels: [Show, string][] = [
  ['color', 'Colour'],
  ['red', 'Red'],
  ['green', 'Green'],
  ['blue', 'Blue'],
  ['luminance', 'Luminance'],
  ['false-color', 'False colour'],
  ['error', 'Standard error'],
  ['relative-error', 'Relative error'],
  ['samples', 'Sample count'],
];

const kPhotonLabels: [Photons, string][] = [
  ['none', 'None'],
  ['few', '10,000'],
  ['many', '100,000'],
  ['caustic', '100,000, caustics only'],
];

export interface ControlsProps extends CompareControlsProps {
  film: Film | undefined;
  display: DisplaySettings;
  /** What the job has besides beauty. */
  layers: readonly string[];
  /** Empty: beauty. */
  layer: string;
  photons: Photons;
  drawing: boolean;
  onPhotons: (photons: Photons) => void;
  onDisplay: (display: DisplaySettings) => void;
  onLayer: (layer: string) => void;
  onNormalize: () => void;
  onDrawing: (drawing: boolean) => void;
}

export function Controls(props: ControlsProps) {
  const {film, display, layers, layer, against, photons, drawing, onPhotons, onDisplay, onLayer, onNormalize, onDrawing} = props;
  useFilmVersion(film, 500);
  const legend = legendOf(against?.how ?? 'picture', display, film?.mostSamples() ?? 0);
  return (
    <div class="controls" role="group" aria-label="Display settings">
      {layers.length > 0 && (
        <label>
          Layer
          <select value={layer} onChange={(event) => onLayer(event.currentTarget.value)}>
            {['', ...layers].map((each) => (
              <option key={each} value={each}>
                {layerLabel(each)}
              </option>
            ))}
          </select>
        </label>
      )}
      <label>
        Show
        <select value={display.show} onChange={(event) => onDisplay({...display, show: event.currentTarget.value as Show})}>
          {kShowLabels.map(([show, label]) => (
            <option key={show} value={show}>
              {label}
            </option>
          ))}
        </select>
      </label>
      <label>
        Exposure
        <input type="range" min={-10} max={10} step={0.25} value={display.exposure} aria-valuetext={`${display.exposure} stops`} onInput={(event) => onDisplay({...display, exposure: Number(event.currentTarget.value)})} />
        <NumberField class="short" label="Exposure in stops" least={-kMaxStops} most={kMaxStops} step={0.25} value={display.exposure} onValue={(exposure) => onDisplay({...display, exposure})} />
      </label>
      <button type="button" title="Fit the exposure to the picture (N)" onClick={onNormalize}>
        Auto
      </button>
      <label>
        Gamma
        <NumberField class="short" least={0.1} most={kMaxGamma} step={0.1} value={display.gamma} onValue={(gamma) => onDisplay({...display, gamma})} />
      </label>
      <label>
        View
        <select value={display.view} onChange={(event) => onDisplay({...display, view: event.currentTarget.value === 'filmic' ? 'filmic' : 'plain'})}>
          <option value="plain">Plain</option>
          <option value="filmic">Filmic</option>
        </select>
      </label>
      <label>
        Photon map
        <select class="photons" value={photons} title="Draws photons over the picture. A small job renders them." onChange={(event) => onPhotons(event.currentTarget.value as Photons)}>
          {kPhotonLabels.map(([each, label]) => (
            <option key={each} value={each}>
              {label}
            </option>
          ))}
        </select>
      </label>
      <CompareControls {...props} />
      <button type="button" aria-pressed={drawing} title="Drag a rectangle to measure it (M, or with Shift)" onClick={() => onDrawing(!drawing)}>
        Region
      </button>
      {legend && (
        <div class="legend" role="img" aria-label={`Colours from ${legend.join(' to ')}`}>
          <span class="ramp" />
          {legend.map((text, i) => (
            <span key={i}>{text}</span>
          ))}
        </div>
      )}
    </div>
  );
}
