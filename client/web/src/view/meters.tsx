/** The meters of a job's scene over its picture, and their readings. */
import {useEffect, useMemo, useState} from 'preact/hooks';
import {fetchReadings} from '../api/meters';
import {fetchSpec} from '../api/submit';
import {toScreen, type Camera, type Point, type Size} from '../model/camera';
import {sceneOf} from '../model/job_form';
import {hasEnded} from '../model/jobs';
import {labelPlaces, marksOf, readingTexts, type MeterMark} from '../model/meters';
import type {Job} from '../wire/lightmill/v1/farm_pb';
import type {Scene} from '../wire/lightmill/v1/scene_pb';
import type {MeterReading} from '../wire/lightmill/v1/web_pb';
import {usePolled} from './polled';

const kActiveMs = 2_000;
const kEndedMs = 60_000;

export interface MeterRow {
  name: string;
  radiometric: string;
  photometric: string;
  /** Undefined behind the camera. */
  mark: MeterMark | undefined;
}

function rowsOf(scene: Scene, marks: Map<number, MeterMark>, readings: readonly MeterReading[]): MeterRow[] {
  return scene.meters.slice(0, readings.length).map((meter, i) => {
    const [radiometric, photometric] = readingTexts(meter, readings[i]!);
    return {name: meter.name, radiometric, photometric, mark: marks.get(i)};
  });
}

/** Empty if the job reads no meters, and until they arrive. */
export function useMeters(job: Job | undefined): readonly MeterRow[] {
  const id = job?.id;
  const active = job !== undefined && !hasEnded(job.state);
  const ask = async (signal: AbortSignal) => (id === undefined ? [] : fetchReadings(id, signal));
  const [readings] = usePolled(ask, `${id}`, active ? kActiveMs : kEndedMs);
  const [known, setKnown] = useState<{id: bigint; scene: Scene; marks: Map<number, MeterMark>}>();
  const some = (readings?.length ?? 0) > 0;
  useEffect(() => {
    if (id === undefined || !some) {
      return;
    }
    let left = false;
    fetchSpec(id)
      .then((spec) => {
        const scene = sceneOf(spec);
        if (!left && spec.settings) {
          setKnown({id, scene, marks: marksOf(scene, spec.settings)});
        }
      })
      .catch(() => undefined);  // the picture is shown without meters
    return () => {
      left = true;
    };
  }, [id, some]);
  return useMemo(() => (known && readings && known.id === id ? rowsOf(known.scene, known.marks, readings) : []), [known, readings, id]);
}

export function MeterMarks({rows, camera, screen}: {rows: readonly MeterRow[]; camera: Camera; screen: Size}) {
  const place = (at: Point) => toScreen(camera, screen, at);
  const line = (points: readonly Point[]) => points.map(place).map(({x, y}) => `${x.toFixed(1)},${y.toFixed(1)}`).join(' ');
  const labels = rows.flatMap(({name, photometric, mark}) => {
    const at = mark && place(mark.at);
    return at ? [{name, mark, at: {x: at.x + 7, y: at.y - 7}, text: `${name} ${photometric}`}] : [];
  });
  const places = labelPlaces(labels);
  return (
    <svg class="meter-marks" aria-hidden="true" width={screen.width} height={screen.height}>
      {labels.map(({name, mark}) => {
        const {x, y} = place(mark.at);
        return (
          <g key={name}>
            {mark.outline.length > 0 && <polygon points={line(mark.outline)} />}
            {mark.tip && <polyline points={line([mark.at, mark.tip])} />}
            {mark.outline.length === 0 && <circle cx={x} cy={y} r={4} />}
          </g>
        );
      })}
      {/* After all lines, so that no line crosses a text. */}
      {labels.map(({name, text}, i) => (
        <text key={name} x={places[i]!.x} y={places[i]!.y}>
          {text}
        </text>
      ))}
    </svg>
  );
}

export function MetersPanel({rows, shown, onShown}: {rows: readonly MeterRow[]; shown: boolean; onShown: (shown: boolean) => void}) {
  return (
    <section class="panel" aria-labelledby="meters-title">
      <h2 id="meters-title">Meters</h2>
      <label class="check">
        <input type="checkbox" checked={shown} onChange={(event) => onShown(event.currentTarget.checked)} /> over the picture
      </label>
      <dl class="meters">
        {rows.map(({name, radiometric, photometric}) => (
          <div key={name}>
            <dt>{name}</dt>
            <dd>{radiometric ? `${photometric} · ${radiometric}` : 'no samples yet'}</dd>
          </div>
        ))}
      </dl>
      <p class="muted">Each ± has 95% confidence.</p>
    </section>
  );
}
