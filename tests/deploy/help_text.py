"""Reads the programs' commands and options from --help, for the tests of generated files."""
import functools
import re
import subprocess

from waiting import TIMEOUT_S

PROGRAMS = ["lightmill", "lightmill-server", "lightmill-worker"]


@functools.cache
def _printed(words):
    return subprocess.run([*words, "--help"], capture_output=True, text=True, check=True, timeout=TIMEOUT_S).stdout


def help_of(folder, words):
    """The lines of `words --help`. The first word is a program of the folder."""
    return _printed((folder / words[0], *words[1:])).splitlines()


def options_and_commands(lines):
    """(option names, command names), as help lists them below the titles of groups, indented by two spaces."""
    options, commands, in_group = set(), [], False
    for line in lines:
        if line and not line.startswith(" "):
            in_group = line != "Examples:" and re.fullmatch(r"[A-Z][A-Za-z ]*( \(.*\))?:", line) is not None
        elif in_group and (match := re.match(r"  ([a-z][a-z-]*)(\s|$)", line)):
            commands.append(match.group(1))
        elif in_group and re.match(r"  (-\w,)?--", line):  # one option, or the list of those for access
            for names in re.findall(r"(?<!\S)((?:-\w,)?--[a-z][a-z-]*)(?!\S)", line[2:].split("  ")[0]):
                options.update(names.split(","))
    return options, commands


def all_commands(folder, words):
    """(words, option names, command names) of a command and of all commands below it."""
    options, commands = options_and_commands(help_of(folder, words))
    yield words, options, commands
    for command in commands:
        yield from all_commands(folder, [*words, command])
