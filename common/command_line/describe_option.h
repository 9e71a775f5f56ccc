// A hidden option that describes the program, for completions, manual pages and docs/reference.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace lightmill {

/// Adds the hidden option --describe bash|zsh|fish|man|markdown. It prints the description and ends the program, as --version
/// does. A manual page has the date of $SOURCE_DATE_EPOCH, or none.
void add_describe_option(CLI::App& app, const std::string& version);

}  // namespace lightmill
