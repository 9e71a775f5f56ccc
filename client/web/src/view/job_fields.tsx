/** Form fields of a job: name, size, method, seed, goal and priority. */
import {useId} from 'preact/hooks';
import {kMinPriority, kMaxPriority, type JobForm} from '../model/job_form';
import {NumberField} from './number_field';
import {useFarm} from './store';

export interface JobFieldsProps {
  form: JobForm;
  /** `of`: the changed field. */
  onForm: (form: JobForm, of: string) => void;
}

const isSeed = (text: string): boolean => /^\d{1,20}$/.test(text) && BigInt(text) < 2n ** 64n;

type NumberKey = {[Key in keyof JobForm]: JobForm[Key] extends number ? Key : never}[keyof JobForm];

export function JobFields({form, onForm}: JobFieldsProps) {
  const methods = useId();
  const {greeting} = useFarm();
  const set = (change: Partial<JobForm>) => onForm({...form, ...change}, Object.keys(change).join());
  const number = (key: NumberKey, label: string, more: {least?: number; most?: number; step?: number; whole?: boolean; title?: string} = {}) => (
    <label title={more.title}>
      {label}
      <NumberField step={more.step ?? 1} least={more.least} most={more.most} value={form[key]} onValue={(value) => set({[key]: more.whole === false ? value : Math.round(value)})} />
    </label>
  );
  return (
    <div class="job-fields">
      <label class="whole">
        Name
        <input type="text" maxLength={greeting?.maxNameBytes} value={form.name} onInput={(event) => set({name: event.currentTarget.value})} />
      </label>
      {number('width', 'Width', {least: 1, most: greeting?.maxSide})}
      {number('height', 'Height', {least: 1, most: greeting?.maxSide})}
      <label>
        Method
        <input type="text" list={methods} value={form.method} onInput={(event) => set({method: event.currentTarget.value})} />
        <datalist id={methods}>
          {greeting?.methods.map(({name}) => (
            <option key={name} value={name} />
          ))}
        </datalist>
      </label>
      <label title="The same seed gives the same picture, bit for bit">
        Seed
        <input type="text" inputMode="numeric" pattern="\d*" value={String(form.seed)} onChange={(event) => isSeed(event.currentTarget.value) && set({seed: BigInt(event.currentTarget.value)})} />
      </label>
      <fieldset class="whole">
        <legend>
          Goal <span class="muted">the first one that is reached ends the job; 0: no limit</span>
        </legend>
        {number('samples', 'Samples', {least: 0, title: 'Per pixel'})}
        {number('percent', 'Error, ±%', {least: 0, step: 0.1, whole: false, title: 'With 95% confidence. 10 is slightly noisy, 3 is smooth'})}
        {number('seconds', 'Seconds', {least: 0, whole: false, title: 'Rendering time'})}
        <label class="check" title="Adaptive sampling: noisy tiles get up to 4 times the samples, smooth tiles down to a quarter">
          <input type="checkbox" checked={form.adaptive} onChange={(event) => set({adaptive: event.currentTarget.checked})} />
          Adaptive
        </label>
      </fieldset>
      <label class="check" title="The film gets a layer for denoising, which takes about a tenth more CPU time, and 80 bytes for each pixel. The page then shows the denoised picture. The raw picture stays as it is">
        <input type="checkbox" checked={form.denoise} onChange={(event) => set({denoise: event.currentTarget.checked})} />
        Denoise
      </label>
      {number('priority', 'Priority', {least: kMinPriority, most: kMaxPriority, title: 'Jobs with a higher priority go first'})}
    </div>
  );
}
