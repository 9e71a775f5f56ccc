// What is wrong with a command line, in plain words.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <string_view>
#include <vector>

namespace lightmill {

/// "; did you mean 'watch'?", of the word that is nearest; empty if none is near.
std::string did_you_mean(std::string_view word, const std::vector<std::string>& words);

/// Of an error that `app` met when it read its command line: "there is no option --sise; did you mean '--size'?".
std::string usage_error_text(const CLI::App& app, const CLI::ParseError& error);

}  // namespace lightmill
