#include "common/command_line/usage_errors.h"

#include <fmt/ranges.h>
#include <unistd.h>

#include <algorithm>
#include <iterator>

#include "common/base/suggestion.h"
#include "common/base/text_width.h"
#include "common/command_line/command_tree.h"

namespace lightmill {
namespace {

/// The command whose words were read.
const CLI::App& command_read(const CLI::App& app) {
  const std::vector<CLI::App*> below = app.get_subcommands();
  return below.empty() ? app : command_read(*below.front());
}

std::vector<std::string> commands_below(const CommandDoc& command) {
  std::vector<std::string> names;
  std::ranges::transform(command.commands, std::back_inserter(names), &CommandDoc::name);
  return names;
}

/// The parser's text for what is missing, in our words.
std::string missing_text(const CLI::App& read, const std::string& text) {
  constexpr std::string_view kOneOf = "At least 1 option from [", kRequired = " is required";
  if (!text.ends_with(kRequired)) {
    return text;
  }
  const std::string what = text.substr(0, text.size() - kRequired.size());
  if (what == "A subcommand") {
    return fmt::format("a command is missing. Commands: {}", fmt::join(commands_below(command_of(read)), ", "));
  }
  return what.starts_with(kOneOf)
             ? fmt::format("one of {} must be given",
                           CLI::detail::find_and_replace(what.substr(kOneOf.size(), what.size() - kOneOf.size() - 1),
                                                         ",", ", "))
             : what + " must be given";
}

/// The error for the first word that was left over.
std::string unknown_word(const CLI::App& app, std::string_view left_over) {
  const std::string word(left_over.substr(0, left_over.find('=')));
  const CommandDoc command = command_of(app);
  if (!word.starts_with('-')) {
    if (command.commands.empty()) {
      return fmt::format("unexpected argument '{}'", word);
    }
    const std::vector<std::string> names = commands_below(command);
    const std::string near = did_you_mean(word, names);
    return fmt::format("unknown command '{}'{}", word,
                       near.empty() ? fmt::format(". Commands: {}", fmt::join(names, ", ")) : near);
  }
  std::vector<std::string> names;
  for (const OptionDoc& option : command.options) {
    names.insert(names.end(), option.names.begin(), option.names.end());
  }
  return fmt::format("`{}` has no option {}{}", command.words(), word, did_you_mean(word, names));
}

}  // namespace

std::string words_read(const CLI::App& app) {
  return command_of(command_read(app)).words();
}

std::string error_for_terminal(std::string_view text) {
  const int columns = terminal_columns(STDERR_FILENO);
  const std::string lines = wrap_lines(text, columns);
  return columns > 0 && colors_wanted() ? fmt::format("\x1b[31m{}\x1b[0m", lines) : lines;
}

std::string usage_error_text(const CLI::App& app, const CLI::ParseError& error) {
  const std::string text = error.what();
  const CLI::App& read = command_read(app);
  const std::vector<std::string> left_over = read.remaining();
  const bool lacks_command = read.get_require_subcommand_min() > 0 && read.get_subcommands().empty();
  if (!left_over.empty() && (lacks_command || dynamic_cast<const CLI::ExtrasError*>(&error) != nullptr)) {
    return unknown_word(read, left_over.front());
  }
  // CLI11's text for an option that is given twice is about counts.
  const std::size_t twice = text.find(": At Most 1 required");
  return twice == std::string::npos ? missing_text(read, text) : text.substr(0, twice) + " is given more than once";
}

}  // namespace lightmill
