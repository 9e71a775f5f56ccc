#include "common/command_line/usage_errors.h"

#include <fmt/ranges.h>
#include <unistd.h>

#include <algorithm>
#include <iterator>
#include <optional>
#include <utility>

#include "common/base/suggestion.h"
#include "common/base/text_width.h"
#include "common/command_line/command_tree.h"
#include "common/command_line/shell_word.h"

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

/// The parts of a parser's text on both sides of `between`. Nothing if it is not there.
std::optional<std::pair<std::string, std::string>> parts_of(const std::string& text, std::string_view between) {
  const std::size_t at = text.find(between);
  return at == std::string::npos ? std::nullopt
                                 : std::optional(std::pair(text.substr(0, at), text.substr(at + between.size())));
}

/// The parser's text for a value that it cannot read, in our words.
std::string conversion_text(const CLI::App& read, const std::string& text) {
  constexpr std::string_view kBegin = "Could not convert: ";
  const auto parts = text.starts_with(kBegin) ? parts_of(text.substr(kBegin.size()), " = ") : std::nullopt;
  if (!parts) {
    return text;
  }
  const auto& [name, value] = *parts;
  const CLI::Option* const option = read.get_option_no_throw(name);
  return option != nullptr && option->get_items_expected_max() == 0
             ? fmt::format("{} takes no value, got '{}'", name, value)
             : fmt::format("{}: a number is expected, got '{}'", name, value);
}

/// The parser's text for options that need or exclude each other, in our words.
std::string pair_text(const CLI::ParseError& error, const std::string& text) {
  if (dynamic_cast<const CLI::ExcludesError*>(&error) != nullptr) {
    if (const auto names = parts_of(text, " excludes ")) {
      return fmt::format("{} and {} cannot be combined", names->first, names->second);
    }
  }
  if (dynamic_cast<const CLI::RequiresError*>(&error) != nullptr) {
    if (const auto names = parts_of(text, " requires ")) {
      return fmt::format("{} is given without {}", names->first, names->second);
    }
  }
  return text;
}

/// The parser's text for what is missing, in our words.
std::string missing_text(const CLI::App& read, const std::string& text) {
  if (const auto parts = parts_of(text, ": 1 required "); parts && parts->second.ends_with(" missing")) {
    return parts->first + ": a value is expected, got none";
  }
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

/// The command below `top` that has a command of this name, as people type it. Empty if there is none.
std::string parent_of(std::string_view name, const CommandDoc& top) {
  for (const CommandDoc& command : top.commands) {
    for (const std::string& below : commands_below(command)) {
      if (below == name) {
        return command.words();
      }
    }
  }
  return "";
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
    if (const std::string parent = parent_of(word, command); !parent.empty()) {
      return fmt::format("unknown command '{}'. Did you mean `{} {}`?", word, parent, word);
    }
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

/// The error for the first of the words `early`, which stand before a command and are no command's.
std::string early_word(const CLI::App& app, const CLI::App& read, const std::vector<std::string>& early,
                       std::vector<std::string> words) {
  const std::string word = early.front().substr(0, early.front().find('='));
  const CommandDoc command = command_of(read);
  if (!word.starts_with('-') || std::ranges::none_of(command.options, [&](const OptionDoc& option) {
        return std::ranges::find(option.names, word) != option.names.end();
      })) {
    return unknown_word(word.starts_with('-') ? read : app, word);
  }
  for (const std::string& each : early) {
    if (const auto found = std::ranges::find(words, each); found != words.end()) {
      words.erase(found);
    }
  }
  words.insert(words.end(), early.begin(), early.end());
  std::ranges::transform(words, words.begin(), shell_word);
  return fmt::format("{} must follow its command: `{} {}`", word, app.get_name(), fmt::join(words, " "));
}

/// The words before the commands that were read, in order.
std::vector<std::string> early_words(const CLI::App& read) {
  std::vector<std::string> words;
  for (const CLI::App* app = read.get_parent(); app != nullptr; app = app->get_parent()) {
    const std::vector<std::string> left_over = app->remaining();
    words.insert(words.begin(), left_over.begin(), left_over.end());
  }
  return words;
}

}  // namespace

std::string words_read(const CLI::App& app) {
  return command_of(command_read(app)).words();
}

std::string error_for_terminal(std::string_view text) {
  const std::string lines = wrap_lines(text, output_columns(STDERR_FILENO));
  return terminal_columns(STDERR_FILENO) > 0 && colors_wanted() ? fmt::format("\x1b[31m{}\x1b[0m", lines) : lines;
}

std::string usage_error_text(const CLI::App& app, const CLI::ParseError& error, const std::vector<std::string>& words) {
  const std::string text = error.what();
  const CLI::App& read = command_read(app);
  const std::vector<std::string> left_over = read.remaining();
  const std::vector<std::string> early = early_words(read);
  const bool lacks_command = read.get_require_subcommand_min() > 0 && read.get_subcommands().empty();
  const bool extra = dynamic_cast<const CLI::ExtrasError*>(&error) != nullptr;
  const bool missing = dynamic_cast<const CLI::RequiredError*>(&error) != nullptr;
  if (!early.empty() && (extra || missing)) {
    return early_word(app, read, early, words);
  }
  if (!left_over.empty() && (lacks_command || extra)) {
    return unknown_word(read, left_over.front());
  }
  if (missing) {
    // A misspelt option is more likely the mistake than the one that is missing.
    const auto unknown = std::ranges::find_if(left_over, [](const std::string& word) { return word.starts_with('-'); });
    if (unknown != left_over.end()) {
      return unknown_word(read, *unknown);
    }
  }
  if (dynamic_cast<const CLI::ConversionError*>(&error) != nullptr) {
    return conversion_text(read, text);
  }
  if (const std::string pair = pair_text(error, text); pair != text) {
    return pair;
  }
  // CLI11's text for an option that is given twice is about counts.
  const std::size_t twice = text.find(": At Most 1 required");
  return twice == std::string::npos ? missing_text(read, text) : text.substr(0, twice) + " is given more than once";
}

}  // namespace lightmill
