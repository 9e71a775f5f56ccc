// lightmill: the command line of the render farm.
#include <fmt/ranges.h>

#include <cerrno>
#include <cstring>
#include <iostream>
#include <new>
#include <nlohmann/json.hpp>

#include "client/cli/context.h"
#include "client/cli/help_topics.h"
#include "common/base/out_of_memory.h"
#include "common/command_line/describe_option.h"
#include "common/command_line/help_page.h"
#include "common/command_line/option_values.h"
#include "common/command_line/usage_errors.h"

namespace lightmill::cli {
namespace {

constexpr const char* kAbout =
    "Lightmill renders one picture on many machines.\n\n"
    "  lightmill render scene.json -o picture.png  render and wait for the picture\n"
    "  lightmill submit scene.json                 queue a render, print its number\n"
    "  lightmill watch 7                           follow a job\n"
    "  lightmill fetch 7 -o picture.exr            write its current picture\n\n"
    "A farm is one lightmill-server and any number of lightmill-worker processes. Commands use the farm given by "
    "--server or the environment variable LIGHTMILL_SERVER, else 127.0.0.1:7350. Without a farm `render` starts a local "
    "one.";

ExitCode usage_error(std::string_view message, int argc, char** argv) {
  const Console console(has_flag(argc, argv, "--json"), has_flag(argc, argv, "--openjd"));
  return console.finish(
      console.fail(invalid_argument("{}\nTry `lightmill help` or `lightmill help COMMAND`.", message)));
}

/// Groups the commands in `lightmill --help`.
void group_commands(CLI::App& app) {
  const std::vector<std::pair<const char*, std::vector<const char*>>> groups{
      {"Render", {"render", "submit", "watch", "fetch"}},
      {"Jobs", {"jobs", "show", "cancel", "pause", "resume", "priority", "extend", "delete"}},
      {"Farm", {"top", "workers", "log", "tokens", "certs"}},
      {"Scenes and pictures", {"check", "lab", "error", "verify"}},
      {"Help", {"help"}}};
  for (const auto& [group, names] : groups) {
    for (const char* name : names) {
      app.get_subcommand(name)->group(group);
    }
  }
}

int run(int argc, char** argv) {
  Signals signals;
  Context context{signals, {}, {}};
  CLI::App app(kAbout, "lightmill");
  app.footer(fmt::format("`lightmill help COMMAND` explains a command, and `lightmill help TOPIC` a topic: {}.",
                         fmt::join(help_topic_names(), ", ")));
  app.set_help_flag("-h,--help", "print this help");
  app.set_version_flag("--version", "lightmill " LIGHTMILL_VERSION, "print the version");
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
  add_help_command(app, context);
  group_commands(app);
  use_help_pages(app);
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
    return usage_error(usage_error_text(app, error), argc, argv);
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
  lightmill::exit_on_out_of_memory("lightmill", lightmill::cli::kJobFailed,
                                   lightmill::has_flag(argc, argv, "--openjd"));
  return lightmill::cli::run(argc, argv);
}
