// lightmill: the command line of the render farm.
#include <cerrno>
#include <cstring>
#include <iostream>
#include <new>
#include <nlohmann/json.hpp>

#include "client/cli/context.h"
#include "common/base/memory_end.h"
#include "common/base/option_values.h"
#include "common/command_docs/describe_option.h"

namespace lightmill::cli {
namespace {

constexpr const char* kAbout =
    "Lightmill renders one picture on many machines.\n\n"
    "  lightmill render scene.json -o picture.png     render and wait for the picture\n"
    "  lightmill submit scene.json                    queue a render and print its job number\n"
    "  lightmill watch 7                              follow a job\n"
    "  lightmill fetch 7 -o picture.exr               its picture, finished or not\n\n"
    "A farm is one lightmill-server and any number of lightmill-worker processes. Commands talk to the one given by\n"
    "--server or the environment variable LIGHTMILL_SERVER, else to 127.0.0.1:7350. `render` starts a farm of its own "
    "on\n"
    "this machine when there is none.";

constexpr const char* kFooter =
    "Exit codes: 0 done, 1 the job failed, 2 bad usage or bad input, 3 the farm cannot be reached or is full, 130 "
    "interrupted.\n"
    "`lightmill COMMAND --help` says more about a command.";

ExitCode usage_error(std::string_view message, int argc, char** argv) {
  const Console console(has_flag(argc, argv, "--json"), has_flag(argc, argv, "--openjd"));
  return console.finish(
      console.fail(invalid_argument("{}\nTry `lightmill --help` or `lightmill COMMAND --help`.", message)));
}

/// The first word if it is no command, and the words that are; empty if there is nothing wrong with it.
std::string unknown_command(const CLI::App& app, int argc, char** argv) {
  std::vector<std::string> names;
  for (const CLI::App* command : app.get_subcommands({})) {
    names.push_back(command->get_name());
  }
  if (argc < 2 || *argv[1] == '-' || std::ranges::find(names, argv[1]) != names.end()) {
    return "";
  }
  return fmt::format("there is no command '{}'; there are {}", argv[1], fmt::join(names, ", "));
}

/// CLI11's words for an option that was given twice are about counts.
std::string plain_words(const CLI::ParseError& error) {
  const std::string text = error.what();
  const std::size_t at = text.find(": At Most 1 required");
  return at == std::string::npos ? text : text.substr(0, at) + " is given more than once";
}

int run(int argc, char** argv) {
  Signals signals;
  Context context{signals, {}, {}};
  CLI::App app(kAbout, "lightmill");
  app.footer(kFooter);
  app.set_version_flag("--version", "lightmill " LIGHTMILL_VERSION);
  add_describe_option(app, LIGHTMILL_VERSION);
  app.require_subcommand(1);
  add_render_commands(app, context);
  add_watch_commands(app, context);
  add_job_commands(app, context);
  add_show_command(app, context);
  add_worker_commands(app, context);
  add_top_command(app, context);
  add_token_commands(app, context);
  add_log_command(app, context);
  add_error_command(app, context);
  add_verify_command(app, context);
  add_check_command(app, context);
  add_lab_command(app, context);
  add_certs_command(app, context);
  if (const std::string unknown = unknown_command(app, argc, argv); !unknown.empty()) {
    return usage_error(unknown, argc, argv);
  }
  refuse_empty_values(app);
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& asked) {  // --help, --version
    app.exit(asked);
    std::cout.flush();
    return std::cout.good() || errno == EPIPE
               ? kDone
               : Console(false).fail(internal_error("cannot write to standard output: {}", std::strerror(errno)));
  } catch (const CLI::ParseError& error) {
    return usage_error(plain_words(error), argc, argv);
  }
  const Console console(context.common.json, context.common.openjd);
  try {
    return console.finish(context.run(console));
  } catch (const std::bad_alloc&) {
    const Status status = out_of_memory(fmt::format("`lightmill {}`", app.get_subcommands().front()->get_name()));
    return console.finish(console.fail(internal_error("{}", message_of(status))));
  }
}

}  // namespace
}  // namespace lightmill::cli

int main(int argc, char** argv) {
  lightmill::end_when_memory_ends("lightmill", lightmill::cli::kJobFailed, lightmill::has_flag(argc, argv, "--openjd"));
  return lightmill::cli::run(argc, argv);
}
