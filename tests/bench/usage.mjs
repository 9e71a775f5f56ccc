// What a measurement says of itself: with --help, and where it is not told what it must be.

/** Prints `usage` and ends the program if it was asked for, or if there is no argument. */
export function helpOf(usage) {
  const asked = process.argv.some((word) => word === '--help' || word === '-h');
  if (asked || process.argv.length < 3) {
    (asked ? console.log : console.error)(usage);
    process.exit(asked ? 0 : 2);
  }
}
