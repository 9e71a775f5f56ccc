// lightmill watch | fetch
#include <nlohmann/json.hpp>

#include "client/cli/context.h"
#include "client/cli/farm_choice.h"
#include "client/cli/film_fetch.h"
#include "client/cli/follow.h"
#include "client/cli/job_report.h"
#include "client/cli/live_picture.h"
#include "client/cli/picture_options.h"
#include "client/cli/progress.h"
#include "client/cli/tev_viewer.h"
#include "client/tev/tev_packets.h"

namespace lightmill::cli {
namespace {

constexpr const char* kWatchMore =
    "With -o FILE.png the file is rewritten as the picture improves. When the job is done, every -o is written from\n"
    "the finished film. If the farm goes away, the command retries for ten minutes. Ctrl-C stops watching, not the\n"
    "job. With --tev it ends once the viewer has the whole picture. The exit code is 1 if the viewer does not get it.";

struct WatchOptions {
  std::uint64_t job = 0;
  std::string tev;  ///< HOST:PORT of a viewer; empty: none
  PictureOptions picture;
};

/// Waits until the viewer has the whole picture, or an interruption. Returns whether it has.
bool finish_showing(TevViewer& viewer, Signals& signals) {
  const auto stop_if_interrupted = [&] {
    if (signals.interrupted()) {
      viewer.stop();
    }
  };
  signals.on_event(stop_if_interrupted);
  stop_if_interrupted();
  const bool sent_all = viewer.finish();
  signals.on_event({});
  return sent_all;
}

/// Follows the job until it has ended and is reported. `viewer`: can be null.
ExitCode follow(Context& context, const Console& console, const WatchOptions& options, const PictureOutputs& outputs,
                Farm& farm, TevViewer* viewer) {
  ProgressPrinter progress(console, system_clock());
  // While a job is rendered, the farm sends only the picture.
  LivePicture live(outputs.png_layer.empty() ? options.picture.png_outputs() : std::vector<std::string>{}, outputs.view,
                   system_clock());
  Status live_status = ok_status();
  bool is_paused = false;
  const Result<v1::Job> job = follow_job(farm, options.job, live.wanted() || viewer != nullptr, context.signals,
                                         console, [&](const v1::WatchJobResponse& response) {
                                           is_paused = response.job().state() == v1::JOB_STATE_PAUSED;
                                           progress.show(response.job());
                                           if (viewer != nullptr) {
                                             viewer->update(response);
                                           }
                                           if (live_status.ok()) {
                                             live_status = live.update(response);
                                           }
                                         });
  if (!job.ok()) {
    if (context.signals.interrupted()) {
      console.notice(fmt::format(
          "job {0} {1}. Follow it again with `lightmill watch {0}{2}`", options.job,
          is_paused ? fmt::format("is paused: `lightmill resume {}` continues it", options.job) : "continues",
          context.common.farm_options()));
    }
    return console.fail(job.status());
  }
  if (!live_status.ok()) {
    return console.fail(live_status);
  }
  return report_ended_job(console, *farm.connection, *job, outputs);
}

Result<ExitCode> watch(Context& context, const Console& console, const WatchOptions& options) {
  LM_ASSIGN_OR_RETURN(const PictureOutputs outputs, options.picture.checked());
  Farm farm;
  LM_ASSIGN_OR_RETURN(farm.connection, connect(context.common, console));
  if (const Result<v1::Job> job = farm.connection->get_job(options.job); !job.ok()) {
    return console.fail(job.status());
  }
  if (options.tev.empty()) {
    return follow(context, console, options, outputs, farm, nullptr);
  }
  TevViewer viewer(*parse_host_port(options.tev), options.job, console);
  const ExitCode code = follow(context, console, options, outputs, farm, &viewer);
  const bool shown = finish_showing(viewer, context.signals);
  return code == kDone && !shown ? kJobFailed : code;
}

Result<ExitCode> fetch(Context& context, const Console& console, const WatchOptions& options) {
  LM_ASSIGN_OR_RETURN(const PictureOutputs outputs, options.picture.checked());
  LM_ASSIGN_OR_RETURN(const std::unique_ptr<CoordinatorClient> connection, connect(context.common, console));
  return fetch_and_report(console, *connection, options.job, outputs);
}

using WatchAction = Result<ExitCode> (*)(Context&, const Console&, const WatchOptions&);

CLI::App* add_command(CLI::App& app, Context& context, const std::shared_ptr<WatchOptions>& options, const char* name,
                      const char* about, WatchAction action) {
  CLI::App* command = app.add_subcommand(name, about);
  add_job_number(*command, options->job);
  add_picture_options(*command, options->picture);
  add_common_options(*command, context);
  command->callback([&context, options, action] {
    context.run = [&context, options, action](const Console& console) { return action(context, console, *options); };
  });
  return command;
}

}  // namespace

void add_watch_commands(CLI::App& app, Context& context) {
  const auto options = std::make_shared<WatchOptions>();
  CLI::App* watch_command = add_command(app, context, options, "watch", "Follow a job until it ends.", watch);
  watch_command->footer(kWatchMore);
  watch_command
      ->add_option("--tev", options->tev,
                   fmt::format("show the picture in tev or HDRView at this address (without a value: {})", kTevAddress))
      ->type_name("HOST:PORT")
      ->option_text("[HOST:PORT]")  // CLI11's own text shows the default as if it applied without the option
      ->expected(0, 1)
      ->default_str(std::string(kTevAddress))
      ->check(readable(parse_host_port));
  add_openjd_option(*watch_command, context);
  add_command(app, context, options, "fetch", "Write a job's current picture.", fetch)
      ->get_option("--output")
      ->required();
}

}  // namespace lightmill::cli
