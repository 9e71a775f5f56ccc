// A hidden option that describes the program, for the build's completions and manual pages.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace lightmill {

/// Adds the hidden option --describe bash|zsh|fish|man. It prints the description and ends the program, as --version
/// does. A manual page has the date of $SOURCE_DATE_EPOCH, or none.
void add_describe_option(CLI::App& app, const std::string& version);

}  // namespace lightmill
