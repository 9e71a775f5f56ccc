import {expect, test} from 'vitest';
import {begun, edited, kMaxEdits, redone, settled, undone} from '../src/model/undo';

test('undo and redo follow the order of the edits', () => {
  let edits = edited(edited(begun(1), 2, ''), 3, '');
  edits = undone(edits);
  expect(edits.now).toBe(2);
  expect(redone(edits).now).toBe(3);
  edits = undone(undone(edits));
  expect(edits.now).toBe(1);
  expect(redone(redone(redone(edits))).now).toBe(3);
});

test('one undo takes back all steps of a continuous edit', () => {
  let edits = edited(edited(edited(begun(1), 2, 'camera'), 3, 'camera'), 4, 'lamp');
  expect(undone(edits).now).toBe(3);
  expect(undone(undone(edits)).now).toBe(1);
  edits = edited(settled(edits), 5, 'lamp');
  expect(undone(edits).now).toBe(4);
});

test('a new edit clears redo, and the oldest edits are dropped', () => {
  expect(redone(edited(undone(edited(begun(1), 2, '')), 9, '')).now).toBe(9);
  let edits = begun(0);
  for (let i = 1; i <= 2 * kMaxEdits; ++i) {
    edits = edited(edits, i, '');
  }
  expect(edits.past.length).toBe(kMaxEdits);
  expect([edits, undone(edits), redone(undone(edits))].map(({first}) => first)).toEqual([0, 0, 0]);
});
