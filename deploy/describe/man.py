"""Manual page for section 1, in man macros."""
import os
import re
import time

from commands import by_group, shared_options

PROGRAMS = ("lightmill", "lightmill-server", "lightmill-worker")
ESCAPES = {"\\": "\\e", "-": "\\-", "'": "\\(aq", "^": "\\(ha", "~": "\\(ti", "`": "\\(ga"}


def escaped(text):
    """The text, escaped for troff. Text between backticks is bold."""
    parts = [re.sub(r"[\\\-'^~`]", lambda found: ESCAPES[found[0]], part) for part in re.split(r"`([^`]*)`", text)]
    out = parts[0] + "".join(f"\\fB{bold}\\fR{plain}" for bold, plain in zip(parts[1::2], parts[2::2], strict=True))
    return "\\&" + out if out.startswith(".") else out


def bold(text):
    return f"\\fB{escaped(text)}\\fR"


def italic(text):
    return f"\\fI{escaped(text)}\\fR"


def paragraphs(text):
    """Paragraphs, filled. Lines indented by two spaces keep their breaks."""
    out, filled, begun = "", True, False  # begun: the paragraph has a line
    for line in text.split("\n") if text else []:
        if not line:
            begun = False
            continue
        if line.startswith("  "):
            out += ".PP\n.nf\n" if filled else "" if begun else "\n"
            filled = False
        else:
            out += ("" if begun else ".PP\n") if filled else ".fi\n.PP\n"
            filled = True
        begun = True
        out += escaped(line) + "\n"
    return out if filled else out + ".fi\n"


def section(title, text):
    """Drops a first .PP, because a section begins with a paragraph anyway."""
    return f".SH {title}\n" + text.removeprefix(".PP\n")


def heading(option):
    """"\\fB\\-o\\fR, \\fB\\-\\-output\\fR \\fIFILE\\fR"."""
    names = ", ".join(map(bold, option.names))
    return f"{names} {italic(option.shown_value)}" if option.value else names


def entry(title, option):
    body = escaped(option.text + (f" (default: {option.default})" if option.default else ""))
    body += f"; also by the variable {bold(option.variable)}" if option.variable else ""
    return f".TP\n{title}\n{body}\n"


def synopsis(command):
    line = f"{bold(command.words)} [\\fIOPTIONS\\fR]"
    for position in command.positions:
        name = italic(position.names[0]) + (" ..." if position.repeats else "")
        line += f" {name}" if position.required else f" [{name}]"
    if command.commands:
        line += " \\fICOMMAND\\fR" if command.needs_command else " [\\fICOMMAND\\fR]"
    return line


def option_groups(options):
    """Each group with its title as a subsection."""
    return "".join(("" if group == "Options" else f".SS {escaped(group)}\n") + "".join(entry(heading(option), option) for option in members)
                   for group, members in by_group(options).items())


def command_section(command, program, shared):
    out = f".SS {escaped(command.words.partition(' ')[2])}\n{synopsis(command)}\n" + paragraphs(command.about)
    out += "".join(entry(italic(position.names[0]), position) for position in command.positions)
    # The program's section describes the program's options.
    own = [option for option in command.options if option not in program.options or option.names[-1] == "--help"]
    out += "".join(entry(heading(option), option) for option in own if option not in shared)
    also = [bold(option.names[-1]) for option in own if option in shared]
    out += f".PP\nDescribed below: {', '.join(also)}.\n" if also else ""
    return out + paragraphs(command.footer)


def environment(commands):
    variables = {}
    for command in commands:
        for option in command.options:
            if option.variable:
                variables.setdefault(option.variable, option.names[-1])
    entries = "".join(f".TP\n{bold(variable)}\nas {bold(name)}\n" for variable, name in variables.items())
    return f".SH ENVIRONMENT\n{entries}" if entries else ""


def page_of(program, version, date):
    """The footer shows `date` ("2026-11-23") and `version`."""
    summary = re.split(r"[.:\n]", program.about)[0]
    out = (".\\\" Made from the program's own options.\n"
           f'.TH {escaped(program.name.upper())} 1 "{date}" "Lightmill {escaped(version)}" "Lightmill"\n'
           f".SH NAME\n{escaped(program.name)} \\- {escaped(summary)}\n.SH SYNOPSIS\n{synopsis(program)}\n"
           + section("DESCRIPTION", paragraphs(program.about)) + ".SH OPTIONS\n" + option_groups(program.options))
    below = program.all[1:]
    if below:
        shared = shared_options(below)
        out += ".SH COMMANDS\n" + "".join(command_section(command, program, shared) for command in below)
        out += ".SH OPTIONS OF SEVERAL COMMANDS\n" + option_groups(shared) if shared else ""
    out += environment(program.all)
    out += section("NOTES", paragraphs(program.footer)) if program.footer else ""
    return out + ".SH SEE ALSO\n" + ", ".join(f"{bold(other)}(1)" for other in PROGRAMS if other != program.name) + "\n"


def page(program, version):
    """The page, dated by SOURCE_DATE_EPOCH. Without that, the page is the same every day."""
    seconds = os.environ.get("SOURCE_DATE_EPOCH", "")
    return page_of(program, version, time.strftime("%Y-%m-%d", time.gmtime(int(seconds))) if seconds.isdigit() else "")
