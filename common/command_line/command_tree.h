// A program's commands and options as plain values, taken from its parser. Help, completions, manual pages and
// the reference are made from them.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace lightmill {

/// An option, or a positional argument ("SCENE").
struct OptionDoc {
  std::vector<std::string> names;  ///< a positional argument has one
  std::string value;               ///< "FILE"; empty for a flag
  std::string text;
  std::string default_value;
  std::string variable;  ///< environment variable
  std::string group;     ///< default: "Options"
  bool required = false, repeats = false;
  bool value_optional = false;  ///< the value may be left out; `text` says what is used then

  /// "HOST:PORT", "FILE..." if there may be several, "[HOST:PORT]" if it may be left out. Empty for a flag.
  std::string shown_value() const {
    const std::string words = repeats && !value.ends_with("...") ? value + "..." : value;
    return value_optional ? "[" + words + "]" : words;
  }

  friend bool operator==(const OptionDoc&, const OptionDoc&) = default;
};

struct CommandDoc {
  std::vector<std::string> path;  ///< the program, then the words of the command
  std::string about;
  std::string group;   ///< default: "Subcommands"
  std::string footer;  ///< empty if it is the parent's
  std::vector<OptionDoc> positions;
  std::vector<OptionDoc> options;  ///< with the parent's options that may follow it
  std::vector<CommandDoc> commands;
  bool needs_command = false;

  const std::string& name() const { return path.back(); }
  /// "lightmill workers drain".
  std::string words() const;
};

/// The commands and options that --help shows. Hidden options are left out.
CommandDoc command_tree(const CLI::App& app);
/// The part of the program's tree for this command.
CommandDoc command_of(const CLI::App& app);

}  // namespace lightmill
