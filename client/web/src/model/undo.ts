/** Undo history of an edited value. Pure. */

export interface Edits<Value> {
  /** Before all edits. */
  first: Value;
  past: readonly Value[];
  now: Value;
  future: readonly Value[];
  /** The target of the newest edit. Further edits of it (a drag, a slider) are undone together. */
  of: string;
}

export const kMaxEdits = 200;

export function begun<Value>(value: Value): Edits<Value> {
  return {first: value, past: [], now: value, future: [], of: ''};
}

/** An edit with an empty `of` is always separate. */
export function edited<Value>(edits: Edits<Value>, value: Value, of: string): Edits<Value> {
  const continues = of !== '' && of === edits.of && edits.past.length > 0;
  const past = continues ? edits.past : [...edits.past, edits.now].slice(-kMaxEdits);
  return {first: edits.first, past, now: value, future: [], of};
}

/** Makes the next edit separate. */
export function settled<Value>(edits: Edits<Value>): Edits<Value> {
  return edits.of === '' ? edits : {...edits, of: ''};
}

export function undone<Value>(edits: Edits<Value>): Edits<Value> {
  const now = edits.past.at(-1);
  return now === undefined ? edits : {...edits, past: edits.past.slice(0, -1), now, future: [edits.now, ...edits.future], of: ''};
}

export function redone<Value>(edits: Edits<Value>): Edits<Value> {
  const [now, ...future] = edits.future;
  return now === undefined ? edits : {...edits, past: [...edits.past, edits.now], now, future, of: ''};
}
