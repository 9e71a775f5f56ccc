// What every command gets: the options all commands share, and how a parsed command is run.
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
  CallerFiles caller;  ///< by which the farm is known, and knows who asks
  bool json = false, openjd = false;

  /// What a command that is suggested needs to reach the same farm: empty, or to be put at its end.
  std::string server_words() const { return server.empty() ? "" : " --server " + server; }
};

/// Filled while the command line is parsed; `run` is set by the subcommand that was given.
struct Context {
  Signals& signals;
  CommonOptions common;
  std::function<ExitCode(const Console&)> run;
};

/// Takes whole numbers in decimal digits, from `least` to `most`, for an option of integer type.
CLI::Validator whole_number(std::uint64_t least, std::uint64_t most);
/// The same for signed ones.
CLI::Validator signed_whole_number(std::int64_t least, std::int64_t most);
/// Finite numbers.
CLI::Validator real_number(double least, double most);

/// Takes what `parse` reads without an error.
template <class T>
CLI::Validator readable(Result<T> (*parse)(std::string_view)) {
  return CLI::Validator(
      [parse](std::string& text) {
        const Result<T> value = parse(text);
        return value.ok() ? std::string() : message_of(value.status());
      },
      "");
}

/// Adds the position JOB.
void add_job_number(CLI::App& command, std::uint64_t& job);
/// Adds --json.
void add_json_option(CLI::App& command, Context& context);
/// Adds --openjd, for commands that wait for a job.
void add_openjd_option(CLI::App& command, Context& context);
/// Adds --json, --server, and how the farm is to know who asks.
void add_common_options(CLI::App& command, Context& context);

// One function per group of commands, each in its own file under commands/.
void add_render_commands(CLI::App& app, Context& context);  ///< render, submit
void add_watch_commands(CLI::App& app, Context& context);   ///< watch, fetch
void add_job_commands(CLI::App& app, Context& context);     ///< jobs, cancel, pause, resume, extend, delete
void add_show_command(CLI::App& app, Context& context);
void add_token_commands(CLI::App& app, Context& context);   ///< tokens, tokens create, revoke
void add_log_command(CLI::App& app, Context& context);      ///< log
void add_worker_commands(CLI::App& app, Context& context);  ///< workers, workers drain
void add_top_command(CLI::App& app, Context& context);
void add_error_command(CLI::App& app, Context& context);
void add_verify_command(CLI::App& app, Context& context);
void add_check_command(CLI::App& app, Context& context);
void add_lab_command(CLI::App& app, Context& context);
void add_certs_command(CLI::App& app, Context& context);  ///< certs init, server, worker, person, show
void add_help_command(CLI::App& app, Context& context);

}  // namespace lightmill::cli
