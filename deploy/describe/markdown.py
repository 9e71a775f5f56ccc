"""Part of docs/reference/command-line.md: the program, each command, and the options that several commands have."""
import itertools
import re

from commands import by_group, shared_options


def block(lines):
    return f"```text\n{lines}```\n\n"


def markdown_text(text):
    """Indented lines, such as examples, become blocks."""
    out = ""
    for kind, lines in itertools.groupby(text.split("\n"), lambda line: "example" if line.startswith("  ") else "text" if line else ""):
        if kind == "example":
            out += block("".join(line[2:] + "\n" for line in lines))
        elif kind == "text":
            out += " ".join(lines) + "\n\n"
    return out


def cell(text):
    """Text of a table's cell."""
    return re.sub(r"([|*<])", r"\\\1", text)


def code(text):
    """Code in a table's cell, where only bars are escaped."""
    return "`" + text.replace("|", "\\|") + "`"


def row(option):
    text = cell(option.text) + (" (must be given)" if option.required else "")
    if option.default:
        text += "; default: " + (cell(option.default) if " " in option.default else code(option.default))
    text += f"; or {code('$' + option.variable)}" if option.variable else ""
    names = ", ".join(option.names) + (f" {option.shown_value}" if option.value else "")
    return f"| {code(names)} | {text} |\n"


def tables(options):
    """A table for each group."""
    return "".join(f"| {group} | |\n| --- | --- |\n{''.join(map(row, members))}\n" for group, members in by_group(options).items())


def command_part(mark, command, shared):
    out = f"{mark} {command.words}\n\n" + markdown_text(command.about) + block(command.usage + "\n")
    arguments = "".join(f"| {code(position.names[0])} | {cell(position.text)} |\n" for position in command.positions)
    out += f"| Argument | |\n| --- | --- |\n{arguments}\n" if arguments else ""
    out += tables([option for option in command.options if option not in shared])
    also = [code(option.names[-1]) for option in command.options if option in shared]
    out += f"[Also](#options-of-several-commands): {', '.join(also)}.\n\n" if also else ""
    return out + markdown_text(command.footer)


def page(program):
    below = program.all[1:]
    shared = shared_options(below)
    return (command_part("##", program, []) + "".join(command_part("###", command, shared) for command in below)
            + ("### Options of several commands\n\n" + tables(shared) if shared else ""))
