/** Fields for the editable parts of a scene: colours, lights, numbers and points. */
import {ofStrength, ofSwatch, strengthOf, swatchOf} from '../model/color';
import type {Vector} from '../model/orbit';
import type {Slot, SlotGroup} from '../model/scene_edit';
import type {Rgb} from '../model/tone';
import type {Scene} from '../wire/lightmill/v1/scene_pb';
import {NumberField} from './number_field';

const kChannels = ['R', 'G', 'B'] as const;

interface TripleProps {
  /** Prefix of each field's name for screen readers. */
  label: string;
  names: readonly [string, string, string];
  value: Vector;
  least?: number;
  most?: number;
  onValue: (value: Vector) => void;
}

/** Three numbers in a row. */
export function TripleField({label, names, value, least, most, onValue}: TripleProps) {
  return (
    <span class="triple">
      {names.map((name, i) => (
        <NumberField key={name} label={`${label} ${name}`} step={0.01} least={least} most={most} value={value[i]} onValue={(next) => onValue(value.map((each, j) => (i === j ? next : each)) as unknown as Vector)} />
      ))}
    </span>
  );
}

function Swatch({label, value, onValue}: {label: string; value: Rgb; onValue: (value: Rgb) => void}) {
  return <input type="color" aria-label={label} value={swatchOf(value)} onInput={(event) => onValue(ofSwatch(event.currentTarget.value))} />;
}

function ColorField({label, value, onValue}: {label: string; value: Rgb; onValue: (value: Rgb) => void}) {
  return (
    <span class="color-field">
      <Swatch label={label} value={value} onValue={onValue} />
      <TripleField label={label} names={kChannels} least={0} most={1} value={value} onValue={([r, g, b]) => onValue([r, g, b])} />
    </span>
  );
}

function LightField({label, unit, value, onValue}: {label: string; unit: string; value: Rgb; onValue: (value: Rgb) => void}) {
  const {strength, color} = strengthOf(value);
  return (
    <span class="light-field">
      <Swatch label={`${label}: colour`} value={color} onValue={(next) => onValue(ofStrength(strength, next))} />
      <NumberField label={`${label}: strength`} step={0.1} least={0} most={1e20} value={Number(strength.toPrecision(6))} onValue={(next) => onValue(ofStrength(next, color))} />
      <span class="muted">{unit}</span>
    </span>
  );
}

type PutSlot = (scene: Scene) => void;

function SlotField({slot, onScene}: {slot: Slot; onScene: PutSlot}) {
  const {label} = slot;
  switch (slot.kind) {
    case 'color':
      return <ColorField label={label} value={slot.value} onValue={(value) => onScene(slot.put(value))} />;
    case 'light':
      return <LightField label={label} unit={slot.unit} value={slot.value} onValue={(value) => onScene(slot.put(value))} />;
    case 'triple':
      return <TripleField label={label} names={slot.names} least={slot.least} most={slot.most} value={slot.value} onValue={(value) => onScene(slot.put(value))} />;
    case 'number':
      return (
        <span class="number-slot">
          {slot.slides && <input type="range" aria-label={`${label}, slider`} min={slot.least} max={slot.most} step={slot.step} value={slot.value} onInput={(event) => onScene(slot.put(Number(event.currentTarget.value)))} />}
          <NumberField class="short" label={label} step={slot.step} least={slot.least} most={slot.most} value={slot.value} onValue={(value) => onScene(slot.put(value))} />
        </span>
      );
    case 'flag':
      return <input type="checkbox" aria-label={label} checked={slot.value} onChange={(event) => onScene(slot.put(event.currentTarget.checked))} />;
    default:
      return slot satisfies never;
  }
}

/** `onScene` gets the new scene, and the id of the changed slot. */
export function SlotGroups({groups, none, onScene}: {groups: SlotGroup[]; none: string; onScene: (scene: Scene, of: string) => void}) {
  if (groups.length === 0) {
    return <p class="muted">{none}</p>;
  }
  return (
    <>
      {groups.map((group) => (
        <details key={group.title} class="slot-group" open={groups.length === 1}>
          <summary>
            {group.title} <span class="muted">{group.kind}</span>
            {group.slots.map((slot) => (slot.kind === 'color' || (slot.kind === 'light' && Math.max(...slot.value) > 0) ? <Chip key={slot.label} slot={slot} /> : null))}
          </summary>
          <div class="slots">
            {group.slots.map((slot) => (
              <div key={slot.label} class="slot" role="group" aria-label={`${group.title}: ${slot.label}`}>
                <span class="slot-name">
                  {slot.label}
                  {'texture' in slot && slot.texture && <small>times {slot.texture}</small>}
                </span>
                <SlotField slot={slot} onScene={(scene) => onScene(scene, `${group.title}/${slot.label}`)} />
              </div>
            ))}
            {group.slots.length === 0 && <p class="muted">Nothing to edit here.</p>}
          </div>
        </details>
      ))}
    </>
  );
}

/** The colour of a slot, shown while its group is closed. */
function Chip({slot}: {slot: Slot & {kind: 'color' | 'light'}}) {
  const color = slot.kind === 'light' ? strengthOf(slot.value).color : slot.value;
  return (
    <svg class="chip" width="14" height="14" viewBox="0 0 14 14" aria-hidden="true">
      <rect x="0.5" y="0.5" width="13" height="13" rx={slot.kind === 'light' ? 7 : 3} fill={swatchOf(color)} stroke="currentColor" stroke-opacity="0.35" />
    </svg>
  );
}
