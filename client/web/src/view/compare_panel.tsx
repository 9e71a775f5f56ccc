/** The comparison with a reference: what it is, how it is shown, and the measured difference. */
import {useRef} from 'preact/hooks';
import type {Against, Comparison} from '../model/comparison';
import {valueText} from '../model/format';
import type {Job} from '../wire/lightmill/v1/farm_pb';
import {kMaxMeasuredPixels, type Measurement} from './comparison';
import type {Reference} from './reference';
import {useFarm} from './store';

const kHowLabels: [Comparison, string][] = [
  ['split', 'Split'],
  ['picture', 'This picture'],
  ['other', 'Reference'],
  ['difference', 'Difference'],
  ['squared-error', 'Relative squared error'],
  ['flip', 'FLIP'],
  ['hdr-flip', 'HDR-FLIP'],
];

function sizeOf(job: Job): string {
  return `${job.crop?.width ?? job.width}×${job.crop?.height ?? job.height}`;
}

export interface CompareControlsProps {
  job: Job | undefined;
  against: Against | undefined;
  onAgainst: (against: Against | undefined) => void;
  onFile: (file: File) => void;
}

export function CompareControls({job, against, onAgainst, onFile}: CompareControlsProps) {
  const {jobs} = useFarm();
  const input = useRef<HTMLInputElement>(null);
  const others = [...jobs.values()].filter((each) => job && each.id !== job.id && sizeOf(each) === sizeOf(job)).sort((a, b) => Number(b.id - a.id));
  const asked = against?.other;
  const unlisted = typeof asked === 'bigint' && !others.some((each) => each.id === asked);
  const choose = (value: string) => {
    if (value === 'file') {
      input.current!.click();
    } else {
      onAgainst(value === '' ? undefined : {other: BigInt(value), how: against?.how ?? 'split', split: against?.split ?? 0.5});
    }
  };
  return (
    <>
      <label>
        Compare with
        <select class="other" value={asked === undefined ? '' : String(asked)} onChange={(event) => choose(event.currentTarget.value)}>
          <option value="">Nothing</option>
          <option value="file">An EXR file…</option>
          {unlisted && <option value={String(asked)}>{`#${asked}`}</option>}
          {others.map((each) => (
            <option key={String(each.id)} value={String(each.id)}>
              {`#${each.id} ${each.name} (${each.method})`}
            </option>
          ))}
        </select>
      </label>
      <input
        ref={input}
        type="file"
        accept=".exr"
        class="sr-only"
        aria-label="An EXR file to compare with"
        tabIndex={-1}
        onChange={(event) => {
          const file = event.currentTarget.files?.[0];
          // So that the same file can be chosen again.
          event.currentTarget.value = '';
          if (file) {
            onFile(file);
          }
        }}
      />
      {against && (
        <label>
          as
          <select aria-label="Comparison" value={against.how} onChange={(event) => onAgainst({...against, how: event.currentTarget.value as Comparison})}>
            {kHowLabels.map(([how, label]) => (
              <option key={how} value={how}>
                {label}
              </option>
            ))}
          </select>
        </label>
      )}
    </>
  );
}

function flipName({hdr, exposure}: NonNullable<Measurement['flip']>): string {
  return hdr ? 'HDR-FLIP' : `FLIP${exposure === 0 ? '' : ` at ${exposure > 0 ? '+' : ''}${exposure} stops`}`;
}

/** `measurement` is undefined until it is computed. */
export function ComparePanel({reference, measurement, pixels}: {reference: Reference; measurement: Measurement | undefined; pixels: number}) {
  const errors = measurement?.errors;
  const rows: [string, string][] =
    measurement && errors
      ? [
          ['relMSE', valueText(errors.relMse)],
          ['relMSE without the worst 0.1%', valueText(errors.relMseTrimmed)],
          ['Energy ratio', valueText(errors.energyRatio)],
          ['SMAPE', valueText(errors.smape)],
          measurement.flip ? [flipName(measurement.flip), valueText(measurement.flip.mean)] : ['FLIP', '…'],
        ]
      : [];
  const waiting = measurement ? 'No pixel has samples in both pictures.' : 'Measuring…';
  return (
    <section class="panel" aria-labelledby="compare-title">
      <h2 id="compare-title">
        Reference <span class="muted">{reference.name}</span>
      </h2>
      {reference.failure && (
        <p class="notice failure" role="alert">
          {reference.failure}
        </p>
      )}
      {!reference.failure && !errors && <p class="muted">{pixels > kMaxMeasuredPixels ? 'Pictures of more than 16 million pixels are not measured here. Use "lightmill error".' : waiting}</p>}
      <dl class="facts measured">
        {rows.map(([name, value]) => (
          <div key={name}>
            <dt>{name}</dt>
            <dd>{value}</dd>
          </div>
        ))}
      </dl>
      {errors && errors.share < 1 && <p class="muted">Over the {(100 * errors.share).toFixed(1)}% of the pixels that both have.</p>}
    </section>
  );
}
