#include "client/cli/context.h"

#include <limits>

#include "client/cli/units.h"
#include "common/command_line/help_page.h"
#include "common/command_line/shell_word.h"
#include "common/security/caller_options.h"

namespace lightmill::cli {
namespace {

/// Rewrites `text` as a plain number, which CLI11 reads without octal or overflow. Returns what is wrong with `text`,
/// or an empty text.
template <class Number>
std::string normalise(const Result<Number>& number, std::string& text) {
  if (!number.ok()) {
    return message_of(number.status());
  }
  text = fmt::format("{}", *number);
  return "";
}

}  // namespace

CLI::Validator whole_number(std::uint64_t least, std::uint64_t most) {
  return CLI::Validator([=](std::string& text) { return normalise(parse_whole(text, least, most), text); }, "");
}

CLI::Validator signed_whole_number(std::int64_t least, std::int64_t most) {
  return CLI::Validator([=](std::string& text) { return normalise(parse_whole(text, least, most), text); }, "");
}

CLI::Validator real_number(double least, double most) {
  return CLI::Validator([=](std::string& text) { return normalise(parse_real(text, least, most), text); }, "");
}

CLI::Validator job_number() {
  return CLI::Validator(
      [](std::string& text) {
        const auto number = parse_whole(text, std::uint64_t{1}, std::numeric_limits<std::uint64_t>::max());
        return number.ok() ? normalise(number, text)
                           : fmt::format("a number from 1 is expected, as `lightmill jobs` prints it, got '{}'", text);
      },
      "");
}

void add_job_number(CLI::App& command, std::uint64_t& job) {
  command.add_option("JOB", job, "the job's number, as `submit` and `jobs` print it")->required()->check(job_number());
}

void add_json_option(CLI::App& command, Context& context) {
  command.add_flag("--json", context.common.json, "print one JSON object instead of text");
}

void add_openjd_option(CLI::App& command, Context& context) {
  command
      .add_flag("--openjd", context.common.openjd,
                "print progress on standard output as Open Job Description (openjd_progress, openjd_status, "
                "openjd_fail), for a farm manager that runs this as a task")
      ->excludes(command.get_option("--json"));
}

std::string CommonOptions::farm_options() const {
  const std::pair<const char*, const std::string*> options[]{{"--server", &server},
                                                             {"--tls-ca", &caller.tls.authority},
                                                             {"--tls-cert", &caller.tls.certificate},
                                                             {"--tls-key", &caller.tls.key},
                                                             {"--token-file", &caller.token_file}};
  std::string words;
  for (const auto& [option, value] : options) {
    words += value->empty() ? "" : fmt::format(" {} {}", option, shell_word(*value));
  }
  return words;
}

void add_common_options(CLI::App& command, Context& context) {
  command
      .add_option(
          "--server", context.common.server,
          "address of the coordinator, or several separated by commas (default: $LIGHTMILL_SERVER, else 127.0.0.1:7350)")
      ->type_name("HOST:PORT");
  add_json_option(command, context);
  add_caller_options(command, context.common.caller, kBriefAccess);
}

}  // namespace lightmill::cli
