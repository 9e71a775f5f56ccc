// Usage texts of the measurements, for --help and for missing arguments.

/** Prints `usage` and ends the program, with --help or without arguments. */
export function helpOf(usage) {
  const asked = process.argv.some((word) => word === '--help' || word === '-h');
  if (asked || process.argv.length < 3) {
    (asked ? console.log : console.error)(usage);
    process.exit(asked ? 0 : 2);
  }
}
