// What holds for the options of all programs.
#pragma once

#include <CLI/CLI.hpp>
#include <algorithm>
#include <string_view>

namespace lightmill {

/// Whether the flag is among the words of a command line: of one with an error no options have been stored.
inline bool has_flag(int argc, char** argv, std::string_view flag) {
  return std::any_of(argv + 1, argv + argc, [flag](const char* word) { return flag == word; });
}

/// Has empty values refused (`--store ""`, as a shell makes of a variable that is not set) of all options and positions
/// that `app` and its commands have by now, before any other check. Variables of the environment that are empty count
/// as not given, which is CLI11's own rule.
inline void refuse_empty_values(CLI::App& app) {
  for (CLI::Option* const option : app.get_options()) {
    if (option->get_items_expected_max() > 0) {
      // A transformation comes before all checks.
      option->transform(CLI::Validator(
          [](const std::string& value) {
            return std::string(value.empty() ? "a value is expected, got an empty one" : "");
          },
          ""));
    }
  }
  for (CLI::App* const command : app.get_subcommands({})) {
    refuse_empty_values(*command);
  }
}

}  // namespace lightmill
