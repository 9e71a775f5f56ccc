#include <fmt/ranges.h>

#include "common/command_line/descriptions.h"

namespace lightmill {
namespace {

/// Prints the words of the command before the cursor, without options and their values.
constexpr std::string_view kPathFunction = R"(
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
)";

std::string quoted(const std::string& text) {
  std::string out = "'";
  for (const char letter : text) {
    if (letter == '\'' || letter == '\\') {
      out += '\\';
    }
    out += letter == '\n' ? ' ' : letter;
  }
  return out + "'";
}

std::string path_function(const CommandDoc& program) {
  std::vector<std::string> below, valued;
  for (const CommandDoc* command : all_commands(program)) {
    for (const CommandDoc& child : command->commands) {
      below.push_back(quoted(child.words()));
    }
    for (const OptionDoc& option : command->options) {
      for (const std::string& name : option.names) {
        if (!option.value.empty() && !option.value_optional) {
          valued.push_back(quoted(fmt::format("{} {}", command->words(), name)));
        }
      }
    }
  }
  const std::string follow =
      below.empty()
          ? ""
          : fmt::format("case {}\n                set path \"$path $word\"\n            ", fmt::join(below, " "));
  return fmt::format(fmt::runtime(kPathFunction), program.name(), follow, fmt::join(valued, " "));
}

/// The flags of `complete` for the option's value.
std::string value_flags(const OptionDoc& option) {
  if (option.value.empty() || option.value_optional) {  // no value needs to follow
    return "";
  }
  const ValueChoice choice = choice_of(option.value);
  switch (choice.kind) {
    case ValueChoice::Kind::file:
      return " -r -F";
    case ValueChoice::Kind::folder:
      return " -x -a '(__fish_complete_directories)'";
    case ValueChoice::Kind::words:
      return fmt::format(" -x -a '{}'", fmt::join(choice.words, " "));
    case ValueChoice::Kind::anything:
      break;
  }
  return " -x";
}

std::string command_lines(const CommandDoc& program, const CommandDoc& command) {
  const std::string begin =
      fmt::format("complete -c {0} -n 'test (__{0}_path) = \"{1}\"'", program.name(), command.words());
  std::string lines;
  for (const CommandDoc& below : command.commands) {
    lines += fmt::format("{} -a {} -d {}\n", begin, below.name(), quoted(below.about));
  }
  for (const OptionDoc& option : command.options) {
    lines += begin;
    for (const std::string& name : option.names) {
      lines += name.starts_with("--") ? fmt::format(" -l {}", name.substr(2)) : fmt::format(" -s {}", name.substr(1));
    }
    lines += fmt::format("{} -d {}\n", value_flags(option), quoted(option.text));
  }
  for (const OptionDoc& position : command.positions) {
    const ValueChoice::Kind kind = choice_of(position.value).kind;
    if (kind == ValueChoice::Kind::file || kind == ValueChoice::Kind::folder) {
      lines += begin + " -F\n";
      break;
    }
  }
  return lines;
}

}  // namespace

std::string fish_completion(const CommandDoc& program) {
  std::string script = fmt::format(
      "# Completion of {0} for fish, made from the program's own options by `{0} --describe fish`.\n", program.name());
  script += path_function(program);
  for (const CommandDoc* command : all_commands(program)) {
    script += command_lines(program, *command);
  }
  return script;
}

}  // namespace lightmill
