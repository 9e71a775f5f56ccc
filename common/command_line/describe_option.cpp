#include "common/command_line/describe_option.h"

#include <fmt/chrono.h>

#include <charconv>
#include <cstdlib>
#include <string_view>

#include "common/command_line/descriptions.h"

namespace lightmill {
namespace {

/// The day of SOURCE_DATE_EPOCH; empty if there is none.
std::string source_date() {
  const char* const text = std::getenv("SOURCE_DATE_EPOCH");
  if (text == nullptr) {
    return "";
  }
  const std::string_view digits = text;
  std::time_t seconds = 0;
  const auto read = std::from_chars(digits.data(), digits.data() + digits.size(), seconds);
  return read.ec == std::errc() && seconds >= 0 ? fmt::format("{:%Y-%m-%d}", fmt::gmtime(seconds)) : "";
}

std::string description_of(const CLI::App& app, const std::string& kind, const std::string& version) {
  const CommandDoc program = command_tree(app);
  if (kind == "bash") {
    return bash_completion(program);
  }
  if (kind == "zsh") {
    return zsh_completion(program);
  }
  if (kind == "fish") {
    return fish_completion(program);
  }
  if (kind == "man") {
    return man_page(program, version, source_date());
  }
  if (kind == "markdown") {
    return markdown_page(program);
  }
  throw CLI::ValidationError("--describe", fmt::format("must be bash, zsh, fish, man or markdown, got '{}'", kind));
}

}  // namespace

void add_describe_option(CLI::App& app, const std::string& version) {
  app.add_option_function<std::string>(
         "--describe",
         [&app, version](const std::string& kind) {
           std::string text = description_of(app, kind, version);
           text.pop_back();  // the printer adds a line end
           throw CLI::CallForVersion(text, 0);
         },
         "")
      ->group("");
}

}  // namespace lightmill
