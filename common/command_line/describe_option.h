// How a program tells about itself to the build, which makes completions and man pages of it.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace lightmill {

/// Adds the hidden option --describe bash|zsh|fish|man, which prints that and ends the program as --version does. The
/// date of a man page is the environment's SOURCE_DATE_EPOCH, or left out.
void add_describe_option(CLI::App& app, const std::string& version);

}  // namespace lightmill
