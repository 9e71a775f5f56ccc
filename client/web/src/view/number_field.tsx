/** A number field that keeps the typed text until the user is done. */
import {useState} from 'preact/hooks';

export interface NumberFieldProps {
  value: number | undefined;
  /** Called when the user is done, with valid numbers only. */
  onValue: (value: number) => void;
  label?: string;
  class?: string;
  least?: number;
  most?: number;
  step: number;
  disabled?: boolean;
}

export function NumberField({value, onValue, label, least, most, step, disabled, class: name}: NumberFieldProps) {
  const [draft, setDraft] = useState<string>();
  const done = (text: string) => {
    setDraft(undefined);
    const typed = Number(text);
    if (text.trim() !== '' && Number.isFinite(typed)) {
      onValue(Math.min(Math.max(typed, least ?? -Infinity), most ?? Infinity));
    }
  };
  return (
    <input
      type="number"
      class={name}
      aria-label={label}
      min={least}
      max={most}
      step={step}
      disabled={disabled}
      value={draft ?? value ?? ''}
      onInput={(event) => setDraft(event.currentTarget.value)}
      onBlur={() => setDraft(undefined)}
      onChange={(event) => done(event.currentTarget.value)}
    />
  );
}
