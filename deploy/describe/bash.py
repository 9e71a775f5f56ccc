"""Completion for bash: to be sourced, or installed beside the others under the program's name."""

# The script follows the words before the cursor: it enters commands and skips values. Then it looks up what may follow in a
# table with one case per command.
BODY = r"""
_PROGRAM() {
  local word path=PROGRAM pending='' i
  local cur=${COMP_WORDS[COMP_CWORD]}
  local commands options valued files folders choices position
  _PROGRAM__at "$path"
  for ((i = 1; i < COMP_CWORD; i++)); do
    word=${COMP_WORDS[i]}
    if [[ $word == = ]]; then
      continue
    elif [[ -n $pending ]]; then
      pending=''
    elif [[ " $valued " == *" $word "* ]]; then
      pending=$word
    elif [[ " $commands " == *" $word "* ]]; then
      path="$path $word"
      _PROGRAM__at "$path"
    fi
  done
  [[ $cur != = ]] || cur=''
  COMPREPLY=()
  if [[ -n $pending ]]; then
    if [[ " $files " == *" $pending "* ]]; then
      position="file"
    elif [[ " $folders " == *" $pending "* ]]; then
      position="folder"
    else
      position=''
      for word in $choices; do
        [[ $word != "$pending="* ]] || mapfile -t COMPREPLY < <(IFS=,; compgen -W "${word#*=}" -- "$cur")
      done
    fi
  elif [[ $cur == -* ]]; then
    mapfile -t COMPREPLY < <(compgen -W "$options" -- "$cur")
    return
  elif [[ -n $commands ]]; then
    mapfile -t COMPREPLY < <(compgen -W "$commands" -- "$cur")
    return
  fi
  case $position in
    file) compopt -o filenames && mapfile -t COMPREPLY < <(compgen -f -- "$cur") ;;
    folder) compopt -o filenames && mapfile -t COMPREPLY < <(compgen -d -- "$cur") ;;
  esac
}

complete -F _PROGRAM PROGRAM
"""


def table_case(command):
    """The case of a command in the script's table: what may follow the command's words."""
    valued = [(name, option.choices) for option in command.options if option.needs_value for name in option.names]
    positions = [option.choices for option in command.positions]
    columns = {
        "commands": [below.name for below in command.commands],
        "options": [name for option in command.options for name in option.names],
        "valued": [name for name, _ in valued],
        "files": [name for name, choices in valued if choices == "file"],
        "folders": [name for name, choices in valued if choices == "folder"],
        "choices": [f"{name}={','.join(choices)}" for name, choices in valued if isinstance(choices, list)],
        "position": [kind for kind in ("file", "folder") if kind in positions][:1],
    }
    return f"    '{command.words}')\n" + "".join(f"      {name}='{' '.join(words)}'\n" for name, words in columns.items()) + "      ;;\n"


def page(program):
    return (f"# Completion of {program.name} for bash, made from the program's own options.\n# shellcheck shell=bash\n\n"
            f"_{program.name}__at() {{\n  case $1 in\n{''.join(map(table_case, program.all))}  esac\n}}\n"
            + BODY.replace("PROGRAM", program.name))
