// lightmill: the command line of the render farm.
#include <fcntl.h>
#include <fmt/ranges.h>
#include <unistd.h>

#include <map>
#include <new>
#include <nlohmann/json.hpp>
#include <sstream>

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
    "A farm is one lightmill-server and any number of lightmill-worker processes. Commands use the farm given by "
    "--server or the environment variable LIGHTMILL_SERVER, else 127.0.0.1:7350. Without a farm `render` starts a local "
    "one.";

constexpr const char* kMoreHelp =
    "`lightmill help COMMAND` explains a command, and `lightmill help TOPIC` a topic: {}.\n\nExamples:\n"
    "  lightmill render scene.json -o picture.png  render and wait for the picture\n"
    "  lightmill submit scene.json                 queue a render, print its number\n"
    "  lightmill watch 7                           follow a job\n"
    "  lightmill fetch 7 -o picture.exr            write its current picture";

/// Examples at the end of each command's help.
const std::map<std::string, const char*> kExamples{
    {"cancel", "  lightmill cancel 7"},
    {"certs", "  lightmill certs init certs"},
    {"certs init", "  lightmill certs init certs"},
    {"certs person", "  lightmill certs person certs ada --roles admin"},
    {"certs server", "  lightmill certs server certs farm.example 10.0.0.5"},
    {"certs show", "  lightmill certs show certs/server.pem"},
    {"certs worker", "  lightmill certs worker certs render-1"},
    {"check", "  lightmill check scenes/cornell-bench-balls.json"},
    {"convert", "  lightmill convert picture.exr -o picture.png --exposure 1 --view filmic"},
    {"delete", "  lightmill delete 7 8"},
    {"error", "  lightmill error picture.exr reference.exr"},
    {"extend", "  lightmill extend 7 --spp 1024"},
    {"fetch", "  lightmill fetch 7 -o picture.exr -o picture.png --exposure 1"},
    {"help", "  lightmill help workers drain\n  lightmill help methods"},
    {"jobs", "  lightmill jobs --state queued,running --owner ada"},
    {"lab", "  lightmill lab docs/experiments/boxes.json -o boxes"},
    {"log", "  lightmill log --job 7\n  lightmill log --caller ada --since 7d"},
    {"pause", "  lightmill pause 7 8 9"},
    {"priority", "  lightmill priority 7 8 --to 10"},
    {"render",
     "  lightmill render scenes/cornell-bench-blocks.json -o box.png --spp 256\n"
     "  lightmill render CornellBox.obj CornellBlocks.obj -o box.exr -o box.png --seconds 2m"},
    {"resume", "  lightmill resume 7 8 9"},
    {"show", "  lightmill show 7 --chart error.svg"},
    {"submit", "  lightmill submit scene.json --error 0.001"},
    {"tokens", "  lightmill tokens"},
    {"tokens create",
     "  lightmill tokens create ada --roles view,submit --out ada.token\n"
     "  lightmill tokens create render --enrol 10 --out render.enrol"},
    {"tokens revoke", "  lightmill tokens revoke 3f2a9c01b7de"},
    {"top", "  lightmill top --interval 0.5s"},
    {"verify", "  lightmill verify picture.exr scenes/cornell-bench-blocks.json --share 5%"},
    {"watch", "  lightmill watch 7 -o live.png"},
    {"workers", "  lightmill workers --wanted"},
    {"workers drain", "  lightmill workers drain render-1"},
    {"workers quarantine", "  lightmill workers quarantine render-1 --reason overheated"},
    {"workers release", "  lightmill workers release render-1"},
};

/// `words`: those of `app`, each with a space behind it.
void add_examples(CLI::App& app, const std::string& words = "") {
  for (CLI::App* command : app.get_subcommands([](CLI::App* each) { return !each->get_name().empty(); })) {
    add_examples(*command, words + command->get_name() + " ");
    // A command without a footer has its parent's.
    const std::string own = command->get_footer() == app.get_footer() ? "" : command->get_footer() + "\n\n";
    command->footer(own + "Examples:\n" + kExamples.at(words + command->get_name()));
  }
}

/// "lightmill help workers drain".
std::string help_command(const CLI::App& app) {
  std::string words = words_read(app);
  return words.insert(words.find(' ') == std::string::npos ? words.size() : words.find(' '), " help");
}

ExitCode usage_error(const CLI::App& app, std::string_view message, int argc, char** argv) {
  const Console console(has_flag(argc, argv, "--json"), has_flag(argc, argv, "--openjd"));
  return console.finish(console.fail(invalid_argument("{}\nTry `{}`.", message, help_command(app))));
}

/// Groups the commands in `lightmill --help`.
void group_commands(CLI::App& app) {
  const std::vector<std::pair<const char*, std::vector<const char*>>> groups{
      {"Render", {"render", "submit", "watch", "fetch"}},
      {"Jobs", {"jobs", "show", "cancel", "pause", "resume", "priority", "extend", "delete"}},
      {"Farm", {"top", "workers", "log", "tokens", "certs"}},
      {"Scenes and pictures", {"check", "lab", "convert", "error", "verify"}},
      {"Help", {"help"}}};
  for (const auto& [group, names] : groups) {
    for (const char* name : names) {
      app.get_subcommand(name)->group(group);
    }
  }
}

/// Keeps the numbers of closed standard streams from the files and sockets that the command opens. Else it would write
/// its results into one of those. Reading and writing such a stream fail with EBADF.
void reserve_standard_streams() {
  for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (::fcntl(stream, F_GETFD) < 0) {
      (void)::open("/dev/null", stream == STDIN_FILENO ? O_WRONLY : O_RDONLY);  // gets the lowest free number
    }
  }
}

int run(int argc, char** argv) {
  Signals signals;
  Context context{signals, {}, {}};
  CLI::App app(kAbout, "lightmill");
  app.footer(fmt::format(kMoreHelp, fmt::join(help_topic_names(), ", ")));
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
  add_convert_command(app, context);
  add_error_command(app, context);
  add_verify_command(app, context);
  add_check_command(app, context);
  add_lab_command(app, context);
  add_certs_command(app, context);
  add_help_command(app, context);
  group_commands(app);
  add_examples(app);
  use_help_pages(app);
  refuse_empty_values(app);
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& asked) {  // --help, --version
    std::ostringstream text;
    app.exit(asked, text, text);
    const Console console(false);
    console.text(text.str());
    return console.finish(kDone);
  } catch (const CLI::ParseError& error) {
    return usage_error(app, usage_error_text(app, error, {argv + 1, argv + argc}), argc, argv);
  }
  const Console console(context.common.json, context.common.openjd);
  try {
    const Result<ExitCode> code = context.run(console);
    return console.finish(code.ok() ? *code : console.fail(code.status()));
  } catch (const std::bad_alloc&) {
    const Status status = out_of_memory(fmt::format("`lightmill {}`", app.get_subcommands().front()->get_name()));
    return console.finish(console.fail(internal_error("{}", message_of(status))));
  }
}

}  // namespace
}  // namespace lightmill::cli

int main(int argc, char** argv) {
  lightmill::cli::reserve_standard_streams();
  lightmill::exit_on_out_of_memory("lightmill", lightmill::cli::kJobFailed,
                                   lightmill::has_flag(argc, argv, "--openjd"));
  return lightmill::cli::run(argc, argv);
}
