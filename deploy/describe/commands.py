"""A program's commands and options, as `PROGRAM --describe` prints them in JSON."""
import dataclasses
import json
import re
import subprocess

SHARED = 3  # an option that this many commands have is shared


@dataclasses.dataclass(frozen=True)
class Option:
    """An option, or a positional argument ("SCENE")."""
    names: tuple  # a positional argument has one
    value: str  # "FILE"; empty for a flag
    text: str
    default: str
    variable: str  # environment variable
    group: str
    required: bool
    repeats: bool
    value_optional: bool  # the value may be left out; `text` says what is used then

    @property
    def shown_value(self):
        """"HOST:PORT", "FILE..." if there may be several, "[HOST:PORT]" if it may be left out. Empty for a flag."""
        words = f"{self.value}..." if self.repeats and not self.value.endswith("...") else self.value
        return f"[{words}]" if self.value_optional else words

    @property
    def needs_value(self):
        return self.value != "" and not self.value_optional

    @property
    def choices(self):
        """The offers of a completion for the value: "file", "folder", a list of words ("plain|filmic"), or None."""
        if self.value.startswith("FILE"):
            return "file"
        if self.value.startswith("DIR"):
            return "folder"
        return self.value.split("|") if re.fullmatch(r"[a-z|-]*\|[a-z|-]*", self.value) else None


@dataclasses.dataclass(frozen=True)
class Command:
    words: str  # "lightmill workers drain"
    about: str
    footer: str  # empty if it is the parent's
    usage: str
    positions: tuple
    options: tuple  # with the parent's options that may follow it
    commands: tuple
    needs_command: bool

    @property
    def name(self):
        return self.words.split(" ")[-1]

    @property
    def all(self):
        """The command and all below it, parents first."""
        return [self, *(each for command in self.commands for each in command.all)]


def option_of(fields):
    return Option(**{**fields, "names": tuple(fields["names"])})


def command_of(fields):
    return Command(**{**fields, "positions": tuple(map(option_of, fields["positions"])), "options": tuple(map(option_of, fields["options"])),
                      "commands": tuple(map(command_of, fields["commands"]))})


def shared_options(commands):
    """Options that several commands have with the same text, so that a page can describe them once."""
    counts = {}
    for command in commands:
        for option in command.options:
            counts[option] = counts.get(option, 0) + 1
    return [option for option, count in counts.items() if count >= SHARED]


def by_group(options):
    """{group: its options}, in their order."""
    groups = {}
    for option in options:
        groups.setdefault(option.group, []).append(option)
    return groups


def read_program(program):
    """The program's Command, and its version."""
    said = json.loads(subprocess.run([program, "--describe"], capture_output=True, text=True, check=True).stdout)
    return command_of(said["program"]), said["version"]
