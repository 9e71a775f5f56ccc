// Parts that every command shares: common options, and the run of a parsed command.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <string>

#include "client/cli/console.h"
#include "client/cli/signals.h"
#include "common/security/caller.h"

namespace lightmill::cli {

struct CommonOptions {
  std::string server;  ///< --server; empty: LIGHTMILL_SERVER, else the default
  CallerFiles caller;  ///< files with which client and farm prove their identity
  bool json = false, openjd = false;

  /// Options that a suggested command needs to reach the same farm. Can be empty.
  std::string farm_options() const;
};

/// Filled while the command line is parsed. The subcommand that was given sets `run`.
struct Context {
  Signals& signals;
  CommonOptions common;
  std::function<Result<ExitCode>(const Console&)> run;  ///< an error is still to be reported
};

/// Accepts whole numbers in decimal digits, from `least` to `most`, for an option of integer type.
CLI::Validator whole_number(std::uint64_t least, std::uint64_t most);
/// The same for signed numbers.
CLI::Validator signed_whole_number(std::int64_t least, std::int64_t most);
/// Accepts finite numbers from `least` to `most`.
CLI::Validator real_number(double least, double most);

/// Accepts what `parse` reads without an error.
template <class T>
CLI::Validator readable(Result<T> (*parse)(std::string_view)) {
  return CLI::Validator(
      [parse](std::string& text) {
        const Result<T> value = parse(text);
        return value.ok() ? std::string() : message_of(value.status());
      },
      "");
}

/// Checks the number of a job.
CLI::Validator job_number();
/// Adds the positional argument JOB.
void add_job_number(CLI::App& command, std::uint64_t& job);
/// Adds --json.
void add_json_option(CLI::App& command, Context& context);
/// Adds --openjd, for commands that wait for a job.
void add_openjd_option(CLI::App& command, Context& context);
/// Adds --json, --server, and the options that identify the caller.
void add_common_options(CLI::App& command, Context& context);

// One function per group of commands, each in a file under commands/.
void add_render_commands(CLI::App& app, Context& context);  ///< render, submit
void add_watch_commands(CLI::App& app, Context& context);   ///< watch, fetch
void add_job_commands(CLI::App& app, Context& context);     ///< jobs, cancel, pause, resume, extend, delete
void add_show_command(CLI::App& app, Context& context);
void add_token_commands(CLI::App& app, Context& context);   ///< tokens, tokens create, revoke
void add_log_command(CLI::App& app, Context& context);      ///< log
void add_worker_commands(CLI::App& app, Context& context);  ///< workers, workers drain
void add_top_command(CLI::App& app, Context& context);
void add_convert_command(CLI::App& app, Context& context);
void add_error_command(CLI::App& app, Context& context);
void add_verify_command(CLI::App& app, Context& context);
void add_check_command(CLI::App& app, Context& context);
void add_lab_command(CLI::App& app, Context& context);
void add_certs_command(CLI::App& app, Context& context);  ///< certs init, server, worker, person, show
void add_help_command(CLI::App& app, Context& context);

}  // namespace lightmill::cli
