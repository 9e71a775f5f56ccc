// A hidden option that describes the program. deploy/describe makes completions, manual pages and docs/reference of it.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace lightmill {

/// Adds the hidden flag --describe. It prints the version and the command tree as JSON and ends the program, as
/// --version does.
void add_describe_option(CLI::App& app, const std::string& version);

}  // namespace lightmill
