// Command line options that the coordinator and the worker share.
#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <functional>
#include <iostream>
#include <optional>
#include <string>
#include <utility>

#include "common/base/status.h"
#include "common/command_line/help_page.h"
#include "common/command_line/option_values.h"
#include "common/command_line/usage_errors.h"

namespace lightmill {

/// For start_logging (log.h).
struct LogOptions {
  std::string level = "info";
  std::string format = "text";
};

inline void add_log_options(CLI::App& app, LogOptions& options) {
  app.add_option("--log-level", options.level, "trace, debug, info, warn, error or off")
      ->type_name("LEVEL")
      ->capture_default_str();
  app.add_option("--log-format", options.format, "text, or json (one object per line)")
      ->type_name("FORMAT")
      ->capture_default_str();
}

/// A number within bounds, in the group "Limits". NaN is refused.
template <class T>
CLI::Option* add_limit(CLI::App& app, const std::string& name, T& value, const char* unit,
                       std::pair<std::type_identity_t<T>, std::type_identity_t<T>> range, const std::string& text) {
  CLI::Option* option = app.add_option(name, value, text)->type_name(unit)->capture_default_str()->group("Limits");
  // Not CLI::Range, which accepts NaN.
  return option->check([range](const std::string& given) -> std::string {
    T number{};
    return CLI::detail::lexical_cast(given, number) && number >= range.first && number <= range.second
               ? ""
               : fmt::format("must be from {} to {}, got {}", range.first, range.second, given);
  });
}

/// Reads the command line, then calls `check`. Returns an exit code, or nothing if the program should run. Errors begin
/// with the program's name. `failed`, if set, gets them too.
inline std::optional<int> parse_options(CLI::App& app, int argc, char** argv, const std::function<Status()>& check,
                                        const std::function<void(const std::string&)>& failed = {}) {
  use_help_pages(app);
  refuse_empty_values(app);
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& asked) {  // --help, --version
    return app.exit(asked);
  } catch (const CLI::ParseError& error) {
    const std::string text = usage_error_text(app, error, {argv + 1, argv + argc});
    std::cerr << error_for_terminal(fmt::format("{0}: {1}\nTry `{0} --help`.", app.get_name(), text)) << "\n";
    if (failed) {
      failed(text);
    }
    return 2;
  }
  if (const Status status = check(); !status.ok()) {
    std::cerr << error_for_terminal(fmt::format("{}: {}", app.get_name(), message_of(status))) << "\n";
    if (failed) {
      failed(message_of(status));
    }
    return 2;
  }
  return std::nullopt;
}

inline std::uint64_t bytes_of_gib(double gib) {
  return static_cast<std::uint64_t>(gib * 1024 * 1024 * 1024);
}

}  // namespace lightmill
