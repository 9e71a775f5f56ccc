// Rules for the option values of all programs.
#pragma once

#include <CLI/CLI.hpp>
#include <algorithm>
#include <string>
#include <string_view>

namespace lightmill {

/// Whether the flag is on the command line. After a parse error no option values are stored, so this looks at the
/// words.
inline bool has_flag(int argc, char** argv, std::string_view flag) {
  return std::any_of(argv + 1, argv + argc, [flag](const char* word) { return flag == word; });
}

/// Makes all present options and positional arguments of `app` and its commands refuse empty values, before any other
/// check. In a shell, `--store "$STORE"` has an empty value if the variable is not set. Empty environment variables
/// count as not given, which is CLI11's own rule.
inline void refuse_empty_values(CLI::App& app) {
  for (CLI::Option* const option : app.get_options()) {
    if (option->get_items_expected_max() > 0) {
      // CLI11 runs transformations before all checks.
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
