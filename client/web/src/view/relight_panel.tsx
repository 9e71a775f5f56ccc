/** Switches, strengths and colours of light groups. The picture follows at once without rendering. */
import {useRef} from 'preact/hooks';
import {ofSwatch, swatchOf} from '../model/color';
import {groupName, isAsRendered, kAsRendered, kMaxGainStops, layerLabel, withGain, type Gain, type Relight} from '../model/layers';

function Row({layer, gain, onGain}: {layer: string; gain: Gain; onGain: (gain: Gain) => void}) {
  const label = layerLabel(layer);
  const {stops, tint} = gain;
  const off = stops === undefined;
  const before = useRef(0); // the strength before it was switched off
  const turn = (on: boolean) => {
    before.current = stops ?? before.current;
    onGain({...gain, stops: on ? before.current : undefined});
  };
  return (
    <div class="relight-row" role="group" aria-label={label}>
      <label class="relight-name">
        <input type="checkbox" aria-label={label} checked={!off} onChange={(event) => turn(event.currentTarget.checked)} /> {groupName(layer)}
      </label>
      <input type="color" aria-label={`${label}: colour`} value={swatchOf(tint)} disabled={off} onInput={(event) => onGain({...gain, tint: ofSwatch(event.currentTarget.value)})} />
      <input
        type="range"
        aria-label={`${label}: stops`}
        aria-valuetext={off ? 'off' : `${stops} stops`}
        min={-kMaxGainStops}
        max={kMaxGainStops}
        step={0.25}
        value={stops ?? 0}
        disabled={off}
        onInput={(event) => onGain({...gain, stops: Number(event.currentTarget.value)})}
      />
      <output>{off ? 'off' : `${stops > 0 ? '+' : ''}${stops}`}</output>
    </div>
  );
}

export interface RelightPanelProps {
  /** The light layers. */
  lights: readonly string[];
  relight: Relight;
  onRelight: (relight: Relight) => void;
}

export function RelightPanel({lights, relight, onRelight}: RelightPanelProps) {
  return (
    <section class="panel relight" aria-labelledby="relight-title">
      <h2 id="relight-title">
        Light groups <span class="muted">stops</span>
      </h2>
      {lights.map((layer) => (
        <Row key={layer} layer={layer} gain={relight.get(layer) ?? kAsRendered} onGain={(gain) => onRelight(withGain(relight, layer, gain))} />
      ))}
      <div class="actions">
        <button type="button" disabled={[...relight.values()].every(isAsRendered)} onClick={() => onRelight(new Map())}>
          As rendered
        </button>
      </div>
      {relight.size > 0 && <p class="muted">The browser mixes the groups, so the error of the sum is unknown. The EXR file keeps each group as rendered.</p>}
    </section>
  );
}
