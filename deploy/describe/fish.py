"""Completion for fish: to be installed beside the others as NAME.fish."""
import re

# Prints the words of the command before the cursor, without options and their values.
PATH_FUNCTION = """
function __{0}_path
    set -l path {0}
    set -l pending ''
    for word in (commandline -opc)[2..]
        if test -n "$pending"
            set pending ''
            continue
        end
        switch "$path $word"
            {1}case {2}
                set pending yes
        end
    end
    echo $path
end

complete -c {0} -f
"""


def quoted(text):
    return "'" + re.sub(r"(['\\])", r"\\\1", text).replace("\n", " ") + "'"


def path_function(program):
    below = [quoted(child.words) for command in program.all for child in command.commands]
    valued = [quoted(f"{command.words} {name}") for command in program.all for option in command.options if option.needs_value
              for name in option.names]
    follow = f"case {' '.join(below)}\n                set path \"$path $word\"\n            " if below else ""
    return PATH_FUNCTION.format(program.name, follow, " ".join(valued))


def value_flags(option):
    """The flags of `complete` for the option's value."""
    if not option.needs_value:
        return ""
    if isinstance(option.choices, list):
        return f" -x -a '{' '.join(option.choices)}'"
    return {"file": " -r -F", "folder": " -x -a '(__fish_complete_directories)'", None: " -x"}[option.choices]


def name_flag(name):
    return f" -l {name[2:]}" if name.startswith("--") else f" -s {name[1:]}"


def command_lines(program, command):
    begin = f"complete -c {program.name} -n 'test (__{program.name}_path) = \"{command.words}\"'"
    lines = [f"{begin} -a {below.name} -d {quoted(below.about)}" for below in command.commands]
    lines += [f"{begin}{''.join(map(name_flag, option.names))}{value_flags(option)} -d {quoted(option.text)}" for option in command.options]
    if any(position.choices in ("file", "folder") for position in command.positions):
        lines.append(f"{begin} -F")
    return "".join(line + "\n" for line in lines)


def page(program):
    return (f"# Completion of {program.name} for fish, made from the program's own options.\n" + path_function(program)
            + "".join(command_lines(program, command) for command in program.all))
