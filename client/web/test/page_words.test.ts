import {expect, test} from 'vitest';
import {inPageWords} from '../src/model/page_words';

test('advice names what the page has', () => {
  expect(inPageWords('there is no camera: one was added that sees all from the front, above and right (--camera chooses another)')).toBe(
    'there is no camera: one was added that sees all from the front, above and right (Edit moves it when the job is submitted)',
  );
  expect(inPageWords("the camera 'far' sees nothing of the scene: choose another with --camera")).toBe(
    "the camera 'far' sees nothing of the scene: choose another camera, or move it with Edit when the job is submitted",
  );
  expect(inPageWords("the whole film is rendered: --crop 10,20,300,200 renders the scene's crop window")).toBe("the whole film is rendered, not the scene's crop window");
  expect(inPageWords('samples (--spp) must be the new total, more than 64')).toBe('samples must be the new total, more than 64');
  expect(inPageWords('left out: animations (`--at SECONDS` shows a moment of one)')).toBe('left out: animations');
});

test('other texts stay as they are', () => {
  expect(inPageWords('the farm is full: it takes 8 workers (--max-workers). Try again later')).toBe('the farm is full: it takes 8 workers (--max-workers). Try again later');
});

/** String literals of notices, joined as C++ joins them. */
function textsIn(sources: Record<string, string>): string[] {
  const texts: string[] = [];
  for (const source of Object.values(sources)) {
    const code = source.replace(/^\s*\/\/.*$/gm, '');
    for (const [literal] of code.matchAll(/"(?:[^"\\\n]|\\.)*"(?:\s*"(?:[^"\\\n]|\\.)*")*/g)) {
      texts.push(literal.replace(/"\s*"/g, '').slice(1, -1));
    }
  }
  return texts;
}

const readers = import.meta.glob<string>('../../../common/scene_io/**/*.cpp', {query: '?raw', import: 'default', eager: true});

test("each option in a reader's notice has words of the page", () => {
  // A text that begins with an option is an error about it, and only the command line has these options.
  const named = textsIn(readers).filter((text) => / [(`]?--[a-z]/.test(text) && !text.startsWith('--') && !text.includes('leave out --at'));
  expect(named.length).toBeGreaterThan(5);
  for (const text of named) {
    expect(inPageWords(text.replaceAll('{}', '1'))).not.toMatch(/--[a-z]/);
  }
});
