// Errors of a command line in plain words.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <string_view>
#include <vector>

namespace lightmill {

/// The text as an error on standard error: in a terminal wrapped to it, and red if colors_wanted.
std::string error_for_terminal(std::string_view text);

/// The command whose words were read: "lightmill workers drain".
std::string words_read(const CLI::App& app);

/// The text of a parse error of `app`: "`lightmill render` has no option --sise. Did you mean '--size'?". `words` are
/// those of the command line, without the program.
std::string usage_error_text(const CLI::App& app, const CLI::ParseError& error, const std::vector<std::string>& words);

}  // namespace lightmill
