// A program's commands and options as plain values, read off its parser: the one source of --help, completions and man
// pages.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace lightmill {

/// An option, or a position ("SCENE").
struct OptionDoc {
  std::vector<std::string> names;  ///< "-o", "--output"; of a position the one it has
  std::string value;               ///< what it takes: "FILE"; empty: nothing, it is a flag
  std::string text;
  std::string default_value;
  std::string variable;  ///< of the environment
  std::string group;     ///< "Options" unless it has another
  bool required = false, repeats = false;
  bool value_optional = false;  ///< the value may be left out; `text` says what is used then

  /// "HOST:PORT", "[HOST:PORT]"; empty for a flag.
  std::string shown_value() const { return value_optional ? "[" + value + "]" : value; }

  friend bool operator==(const OptionDoc&, const OptionDoc&) = default;
};

struct CommandDoc {
  std::vector<std::string> path;  ///< the program, then the words of the command
  std::string about;
  std::string group;   ///< "Subcommands" unless it has another
  std::string footer;  ///< empty where it is its parent's
  std::vector<OptionDoc> positions;
  std::vector<OptionDoc> options;  ///< those of its parent, too, where they may follow it
  std::vector<CommandDoc> commands;
  bool needs_command = false;

  const std::string& name() const { return path.back(); }
  /// "lightmill workers drain".
  std::string words() const;
};

/// What --help shows: hidden options are left out.
CommandDoc command_tree(const CLI::App& app);
/// The part of its program's tree that a command is.
CommandDoc command_of(const CLI::App& app);

/// The command and all below it, parents first.
std::vector<const CommandDoc*> all_commands(const CommandDoc& root);

/// What may be offered for a value.
struct ValueChoice {
  enum class Kind { anything, file, folder, words } kind = Kind::anything;
  std::vector<std::string> words;
};

/// Told by its type name: FILE and DIR, also with alternatives ("FILE|NAME"), and lists of words ("plain|filmic").
ValueChoice choice_of(const std::string& type_name);

}  // namespace lightmill
