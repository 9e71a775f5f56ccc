/** Texts of the farm in the words of the page. Readers of scenes and the coordinator name options of the command line. */

type Change = readonly [RegExp, string];

/** What to do on the page instead. Where the page has nothing of the kind, the advice is left out. */
const kAdvice: readonly Change[] = [
  [/ \(--camera chooses another\)/g, ' (Edit moves it when the job is submitted)'],
  [/: choose another with --camera/g, ': choose another camera, or move it with Edit when the job is submitted'],
  [/ \(--sky off leaves it out\)/g, ' (Edit dims it when the job is submitted)'],
  [/: --crop [-\d,]+ renders the scene's crop window/g, ", not the scene's crop window"],
  [/ \(--layers adds some\)/g, ''],
  [/ \(`--at SECONDS` shows a moment of one\)/g, ''],
  [/ \(--max-bounces\)/g, ''],
  [/only at --max-bounces/g, 'only at the limit of bounces'],
  [/ \(--spp\)/g, ''],
  [/Extend the job with --spp, or submit the scene again with --error/g, 'Extend the samples, or submit the scene again with an error goal'],
  [/choose a smaller --size/g, 'choose a smaller size'],
];

/** The text for people who use the page. */
export function inPageWords(text: string): string {
  return kAdvice.reduce((changed, [from, to]) => changed.replace(from, to), text);
}
