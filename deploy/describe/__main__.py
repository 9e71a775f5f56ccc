"""Prints a shell completion, the manual page or the reference of a program, made from what `PROGRAM --describe` prints.

  python3 deploy/describe PROGRAM bash|zsh|fish|man|markdown
"""
import argparse
import sys

import bash
import commands
import fish
import man
import markdown
import zsh

KINDS = {"bash": bash.page, "zsh": zsh.page, "fish": fish.page, "markdown": markdown.page}


def main():
    parser = argparse.ArgumentParser(prog="deploy/describe", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", help="for example build/release/bin/lightmill")
    parser.add_argument("kind", choices=[*KINDS, "man"])
    options = parser.parse_args()
    program, version = commands.read_program(options.program)
    sys.stdout.write(man.page(program, version) if options.kind == "man" else KINDS[options.kind](program))


if __name__ == "__main__":
    main()
