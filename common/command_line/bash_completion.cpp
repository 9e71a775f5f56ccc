#include <fmt/ranges.h>

#include "common/command_line/descriptions.h"

namespace lightmill {
namespace {

/// The script follows the words before the cursor: it enters commands and skips values. Then it looks up what may
/// follow in a table with one case per command.
constexpr std::string_view kBody = R"(
_{0}() {{
  local word path={0} pending='' i
  local cur=${{COMP_WORDS[COMP_CWORD]}}
  local commands options valued files folders choices position
  _{0}__at "$path"
  for ((i = 1; i < COMP_CWORD; i++)); do
    word=${{COMP_WORDS[i]}}
    if [[ $word == = ]]; then
      continue
    elif [[ -n $pending ]]; then
      pending=''
    elif [[ " $valued " == *" $word "* ]]; then
      pending=$word
    elif [[ " $commands " == *" $word "* ]]; then
      path="$path $word"
      _{0}__at "$path"
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
        [[ $word != "$pending="* ]] || mapfile -t COMPREPLY < <(IFS=,; compgen -W "${{word#*=}}" -- "$cur")
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
}}

complete -F _{0} {0}
)";

/// The command's line of the table: what may follow its words.
std::string table_case(const CommandDoc& command) {
  std::vector<std::string> commands, options, valued, files, folders, choices;
  for (const CommandDoc& below : command.commands) {
    commands.push_back(below.name());
  }
  for (const OptionDoc& option : command.options) {
    options.insert(options.end(), option.names.begin(), option.names.end());
    if (option.value.empty() || option.value_optional) {  // no value needs to follow
      continue;
    }
    valued.insert(valued.end(), option.names.begin(), option.names.end());
    const ValueChoice choice = choice_of(option.value);
    for (const std::string& name : option.names) {
      switch (choice.kind) {
        case ValueChoice::Kind::anything:
          break;
        case ValueChoice::Kind::file:
          files.push_back(name);
          break;
        case ValueChoice::Kind::folder:
          folders.push_back(name);
          break;
        case ValueChoice::Kind::words:
          choices.push_back(fmt::format("{}={}", name, fmt::join(choice.words, ",")));
          break;
      }
    }
  }
  std::string position;
  for (const OptionDoc& at : command.positions) {
    const ValueChoice::Kind kind = choice_of(at.value).kind;
    position = kind == ValueChoice::Kind::file                         ? "file"
               : kind == ValueChoice::Kind::folder && position.empty() ? "folder"
                                                                       : position;
  }
  return fmt::format(
      "    '{}')\n      commands='{}'\n      options='{}'\n      valued='{}'\n      files='{}'\n      folders='{}'\n"
      "      choices='{}'\n      position='{}'\n      ;;\n",
      command.words(), fmt::join(commands, " "), fmt::join(options, " "), fmt::join(valued, " "), fmt::join(files, " "),
      fmt::join(folders, " "), fmt::join(choices, " "), position);
}

}  // namespace

std::string bash_completion(const CommandDoc& program) {
  std::string script = fmt::format(
      "# Completion of {0} for bash, made from the program's own options by `{0} --describe bash`.\n"
      "# shellcheck shell=bash\n\n_{0}__at() {{\n  case $1 in\n",
      program.name());
  for (const CommandDoc* command : all_commands(program)) {
    script += table_case(*command);
  }
  script += "  esac\n}\n";
  return script + fmt::format(fmt::runtime(kBody), program.name());
}

}  // namespace lightmill
