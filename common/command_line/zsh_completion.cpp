#include <fmt/ranges.h>

#include "common/command_line/descriptions.h"

namespace lightmill {
namespace {

/// Text within single quotes. `special` characters get a backslash, as _arguments and _describe require.
std::string quoted(const std::string& text, std::string_view special) {
  std::string out;
  for (const char letter : text) {
    if (letter == '\'') {
      out += "'\\''";
      continue;
    }
    if (letter == '\\' || special.find(letter) != std::string_view::npos) {
      out += '\\';
    }
    out += letter == '\n' ? ' ' : letter;
  }
  return out;
}

std::string action_of(const std::string& type_name) {
  const ValueChoice choice = choice_of(type_name);
  switch (choice.kind) {
    case ValueChoice::Kind::file:
      return "_files";
    case ValueChoice::Kind::folder:
      return "_files -/";
    case ValueChoice::Kind::words:
      return fmt::format("({})", fmt::join(choice.words, " "));
    case ValueChoice::Kind::anything:
      break;
  }
  return " ";
}

std::string option_line(const OptionDoc& option) {
  const bool takes = !option.value.empty();
  std::vector<std::string> names;
  for (const std::string& name : option.names) {
    names.push_back(!takes ? name : name + (name.starts_with("--") ? "=" : "+"));
  }
  const std::string excluded = option.repeats ? "'*'" : fmt::format("'({})'", fmt::join(option.names, " "));
  const std::string words = names.size() == 1 ? names.front() : fmt::format("{{{}}}", fmt::join(names, ","));
  const std::string value = takes ? fmt::format("{}:{}:{}", option.value_optional ? ":" : "", quoted(option.value, ":"),
                                                quoted(action_of(option.value), ""))
                                  : "";
  return fmt::format("    {}{}'[{}]{}'", excluded, words, quoted(option.text, "[]:"), value);
}

std::string function_name(const CommandDoc& command) {
  return fmt::format("_{}", fmt::join(command.path, "__"));
}

std::string function_text(const CommandDoc& command) {
  std::vector<std::string> lines;
  for (const OptionDoc& option : command.options) {
    lines.push_back(option_line(option));
  }
  for (const OptionDoc& position : command.positions) {
    lines.push_back(fmt::format("    '{}:{}:{}'",
                                position.repeats    ? "*"
                                : position.required ? ""
                                                    : ":",
                                quoted(position.names.front(), ":"), action_of(position.value)));
  }
  if (command.commands.empty()) {
    return fmt::format("{}() {{\n  _arguments \\\n{}\n}}\n\n", function_name(command), fmt::join(lines, " \\\n"));
  }
  lines.push_back("    '1: :->command'");
  lines.push_back("    '*:: :->arguments'");
  std::string described, cases;
  for (const CommandDoc& below : command.commands) {
    described += fmt::format("        '{}:{}'\n", below.name(), quoted(below.about, ":"));
    cases += fmt::format("        {}) {} ;;\n", below.name(), function_name(below));
  }
  return fmt::format(
      "{}() {{\n  local curcontext=$curcontext state line\n  local -A opt_args\n  _arguments -C \\\n{}\n"
      "  case $state in\n    command)\n      local -a commands\n      commands=(\n{}      )\n"
      "      _describe -t commands command commands\n      ;;\n"
      "    arguments)\n      case $words[1] in\n{}      esac\n      ;;\n  esac\n}}\n\n",
      function_name(command), fmt::join(lines, " \\\n"), described, cases);
}

}  // namespace

std::string zsh_completion(const CommandDoc& program) {
  std::string script = fmt::format(
      "#compdef {0}\n# Completion of {0} for zsh, made from the program's own options by `{0} --describe zsh`.\n\n",
      program.name());
  for (const CommandDoc* command : all_commands(program)) {
    script += function_text(*command);
  }
  // As a file of $fpath, this is the function's body at the first call. When sourced, it must register itself.
  return script + fmt::format("if [[ $funcstack[1] == _{0} ]]; then\n  _{0} \"$@\"\nelse\n  compdef _{0} {0}\nfi\n",
                              program.name());
}

}  // namespace lightmill
