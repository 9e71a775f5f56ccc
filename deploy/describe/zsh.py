"""Completion for zsh: to be installed as _NAME in a folder of $fpath, or sourced."""


def quoted(text, special):
    """Text within single quotes. `special` characters get a backslash, as _arguments and _describe require."""
    return "".join("'\\''" if letter == "'" else " " if letter == "\n" else f"\\{letter}" if letter in "\\" + special else letter
                   for letter in text)


def action(option):
    if isinstance(option.choices, list):
        return f"({' '.join(option.choices)})"
    return {"file": "_files", "folder": "_files -/", None: " "}[option.choices]


def option_line(option):
    end = (lambda name: "=" if name.startswith("--") else "+") if option.value else lambda name: ""
    names = [name + end(name) for name in option.names]
    excluded = "'*'" if option.repeats else f"'({' '.join(option.names)})'"
    words = names[0] if len(names) == 1 else f"{{{','.join(names)}}}"
    value = f"{':' if option.value_optional else ''}:{quoted(option.value, ':')}:{quoted(action(option), '')}" if option.value else ""
    return f"    {excluded}{words}'[{quoted(option.text, '[]:')}]{value}'"


def position_line(position):
    count = "*" if position.repeats else "" if position.required else ":"
    return f"    '{count}:{quoted(position.names[0], ':')}:{action(position)}'"


def function_name(command):
    return "_" + command.words.replace(" ", "__")


def function_text(command):
    lines = [option_line(option) for option in command.options] + [position_line(position) for position in command.positions]
    if not command.commands:
        return f"{function_name(command)}() {{\n  _arguments \\\n" + " \\\n".join(lines) + "\n}\n\n"
    lines += ["    '1: :->command'", "    '*:: :->arguments'"]
    described = "".join(f"        '{below.name}:{quoted(below.about, ':')}'\n" for below in command.commands)
    cases = "".join(f"        {below.name}) {function_name(below)} ;;\n" for below in command.commands)
    return (f"{function_name(command)}() {{\n  local curcontext=$curcontext state line\n  local -A opt_args\n  _arguments -C \\\n"
            + " \\\n".join(lines) + f"\n  case $state in\n    command)\n      local -a commands\n      commands=(\n{described}      )\n"
            "      _describe -t commands command commands\n      ;;\n"
            f"    arguments)\n      case $words[1] in\n{cases}      esac\n      ;;\n  esac\n}}\n\n")


def page(program):
    # As a file of $fpath, this is the function's body at the first call. When sourced, it must register itself.
    end = f'if [[ $funcstack[1] == _{program.name} ]]; then\n  _{program.name} "$@"\nelse\n  compdef _{program.name} {program.name}\nfi\n'
    return (f"#compdef {program.name}\n# Completion of {program.name} for zsh, made from the program's own options.\n\n"
            + "".join(map(function_text, program.all)) + end)
