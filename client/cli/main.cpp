// lightmill: the command line of the render farm.
#include <cstdio>
#include <nlohmann/json.hpp>

#include "client/cli/context.h"

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
    "Exit codes: 0 done, 1 the job failed, 2 bad usage or bad input, 3 the farm cannot be reached, 130 interrupted.\n"
    "`lightmill COMMAND --help` says more about a command.";

ExitCode usage_error(const CLI::ParseError& error, bool json) {
  return Console(json).fail(
      invalid_argument("{}\nTry `lightmill --help` or `lightmill COMMAND --help`.", error.what()));
}

/// The options of a command line with an error have not been stored: look for the flag itself.
bool wants_json(int argc, char** argv) {
  return std::any_of(argv + 1, argv + argc, [](const char* word) { return std::string_view(word) == "--json"; });
}

int run(int argc, char** argv) {
  Signals signals;
  Context context{signals, {}, {}};
  CLI::App app(kAbout, "lightmill");
  app.footer(kFooter);
  app.set_version_flag("--version", "lightmill " LIGHTMILL_VERSION);
  app.require_subcommand(1);
  add_render_commands(app, context);
  add_watch_commands(app, context);
  add_job_commands(app, context);
  add_show_command(app, context);
  add_worker_commands(app, context);
  add_error_command(app, context);
  add_check_command(app, context);
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& asked) {  // --help, --version
    app.exit(asked);
    return kDone;
  } catch (const CLI::ParseError& error) {
    return usage_error(error, wants_json(argc, argv));
  }
  const Console console(context.common.json);
  return context.run(console);
}

}  // namespace
}  // namespace lightmill::cli

int main(int argc, char** argv) {
  return lightmill::cli::run(argc, argv);
}
