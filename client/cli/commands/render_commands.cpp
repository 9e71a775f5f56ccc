// lightmill render | submit
#include <nlohmann/json.hpp>

#include "client/cli/context.h"
#include "client/cli/farm_choice.h"
#include "client/cli/film_fetch.h"
#include "client/cli/follow.h"
#include "client/cli/job_json.h"
#include "client/cli/job_report.h"
#include "client/cli/picture_options.h"
#include "client/cli/progress.h"
#include "client/cli/render_options.h"
#include "client/cli/submission.h"

namespace lightmill::cli {
namespace {

constexpr const char* kRenderMore =
    "Without -o the pictures are SCENE.exr and SCENE.png in the current folder. Existing files are replaced.\n"
    "`lightmill help farm` says which farm renders it, and what Ctrl-C does. Use `lightmill submit` for jobs that outlive "
    "the command.";

constexpr const char* kSubmitMore =
    "`lightmill watch JOB` follows the job, and `lightmill fetch JOB -o FILE` writes its picture.";

struct RenderCommandOptions {
  RenderOptions render;
  PictureOptions picture;
  bool local = false;
  unsigned threads = 0;
};

void print_notices(const Console& console, const PreparedJob& job) {
  for (const std::string& notice : job.scene.notices) {
    console.notice("note: " + notice);
  }
}

/// Saves the picture of a local farm before the farm ends, if every tile has a sample. Returns what happened, and
/// puts the file names into `object`.
std::string save_interrupted(Farm& farm, std::uint64_t id, const PictureOutputs& outputs, nlohmann::json& object) {
  Result<AssembledFilm> film = fetch_film(*farm.connection, id);
  if (!film.ok()) {
    return fmt::format("nothing is written: {}", message_of(film.status()));
  }
  const Receipt& receipt = film->picture.receipt;
  if (receipt.min_samples == 0) {
    return "nothing is written, because parts of the picture have no samples yet";
  }
  if (const Status status = outputs.denoise ? denoise(film->picture) : ok_status(); !status.ok()) {
    return message_of(status);
  }
  if (const Status status = write_outputs(film->picture, outputs); !status.ok()) {
    return message_of(status);
  }
  object["outputs"] = outputs.paths;
  return fmt::format("the picture so far ({} per pixel) -> {}",
                     samples_per_pixel(receipt.min_samples, receipt.max_samples), fmt::join(outputs.paths, ", "));
}

/// Handles an interruption, and says how. On a shared farm Ctrl-C cancels the job, and its film stays. A closed
/// terminal or a SIGTERM leaves it running, because the user did not decide. A local farm's film is saved, and
/// `object` gets the file names. `server`: the end of commands that reach the same farm.
std::string end_interrupted(Farm& farm, std::uint64_t id, bool by_user, const std::string& server,
                            const PictureOutputs& outputs, nlohmann::json& object) {
  if (farm.local_farm) {
    return save_interrupted(farm, id, outputs, object) + ". The local farm is stopped";
  }
  if (!by_user) {
    return fmt::format("job {} continues. Follow it with `lightmill watch {}{}`", id, id, server);
  }
  const Result<v1::Job> job = farm.connection->cancel_job(id);
  return job.ok()
             ? fmt::format("job {} is cancelled. Get its picture with `lightmill fetch {} -o FILE{}`", id, id, server)
             : fmt::format("job {} could not be cancelled: {}", id, message_of(job.status()));
}

void warn_if_no_worker(const Console& console, CoordinatorClient& connection, const CommonOptions& common) {
  const Result<ListedWorkers> workers = connection.list_workers();
  if (workers.ok() && workers->items.empty()) {
    console.notice(fmt::format("no worker is connected to {}, so the job waits: {}", connection.address(),
                               how_to_start_a_worker(connection.address(), common)));
  }
}

Result<ExitCode> render(Context& context, const Console& console, RenderCommandOptions options) {
  std::vector<std::string>& outputs = options.picture.outputs;
  if (outputs.empty()) {
    const std::string stem = std::filesystem::path(options.render.scene.scenes.front()).stem().string();
    outputs = {stem + ".exr", stem + ".png"};
  }
  LM_ASSIGN_OR_RETURN(PictureOutputs checked, options.picture.checked());
  options.render.denoise = options.picture.denoise;
  options.render.png_layer = options.picture.png_layer;
  LM_ASSIGN_OR_RETURN(const PreparedJob prepared, make_job(options.render, context.signals));
  print_notices(console, prepared);
  const bool exr = std::ranges::any_of(outputs, [](const std::string& path) { return lower_ending(path) == ".exr"; });
  if (!options.render.layers.empty() && !exr) {
    console.notice("note: --layers are written only to EXR files, and none is written: " +
                   fmt::format("{}", fmt::join(outputs, ", ")));
  }
  LM_ASSIGN_OR_RETURN(
      Farm farm, choose_farm(context.common, options.local, {options.threads, options.render.scene.unsandboxed_images},
                             context.signals, console));
  const Result<v1::Job> submitted = submit_job(*farm.connection, prepared, console);
  if (!submitted.ok()) {
    return console.fail(submitted.status());
  }
  checked.is_only_copy = farm.local_farm != nullptr;
  if (!farm.local_farm) {
    checked.remedy = fmt::format(". The farm has the picture: `lightmill fetch {} -o FILE{}`", submitted->id(),
                                 context.common.farm_options());
    warn_if_no_worker(console, *farm.connection, context.common);
  }
  ProgressPrinter progress(console, system_clock());
  const Result<v1::Job> job = follow_job(farm, submitted->id(), false, context.signals, console,
                                         [&](const v1::WatchJobResponse& response) { progress.show(response.job()); });
  if (!job.ok()) {
    nlohmann::json object{{"id", submitted->id()}};
    std::string message = message_of(job.status());
    if (context.signals.interrupted()) {
      message += ": " + end_interrupted(farm, submitted->id(), context.signals.interrupted_by_user(),
                                        context.common.farm_options(), checked, object);
    }
    return console.fail(make_error(job.status().code(), "{}", message), std::move(object));
  }
  return report_ended_job(console, *farm.connection, *job, checked, prepared.scene.notices);
}

Result<ExitCode> submit(Context& context, const Console& console, const RenderOptions& options) {
  LM_ASSIGN_OR_RETURN(const PreparedJob prepared, make_job(options, context.signals));
  print_notices(console, prepared);
  return with_farm(console, context.common, [&](CoordinatorClient& connection) -> Status {
    LM_ASSIGN_OR_RETURN(const v1::Job job, submit_job(connection, prepared, console));
    console.object(to_json(job, prepared.scene.notices));
    for (const std::string& line : method_lines(job)) {
      console.notice(line);
    }
    console.result(std::to_string(job.id()));
    return ok_status();
  });
}

}  // namespace

void add_render_commands(CLI::App& app, Context& context) {
  const auto options = std::make_shared<RenderCommandOptions>();

  CLI::App* render_command = app.add_subcommand("render", "Render a scene, show the progress, and write the picture.");
  render_command->footer(kRenderMore);
  add_render_options(*render_command, options->render);
  add_picture_options(*render_command, options->picture);
  add_local_farm_options(*render_command, options->local, options->threads);
  add_common_options(*render_command, context);
  add_openjd_option(*render_command, context);
  render_command->callback([&context, options] {
    context.run = [&context, options](const Console& console) { return render(context, console, *options); };
  });

  CLI::App* submit_command = app.add_subcommand("submit", "Queue a render on a farm and print the job's number.");
  submit_command->footer(kSubmitMore);
  add_render_options(*submit_command, options->render);
  submit_command
      ->add_flag("--denoise", options->render.denoise,
                 "add the layer features, so that `fetch --denoise` can reconstruct the picture (`lightmill help "
                 "denoise`)")
      ->group("Picture");
  add_common_options(*submit_command, context);
  submit_command->callback([&context, options] {
    context.run = [&context, options](const Console& console) { return submit(context, console, options->render); };
  });
}

}  // namespace lightmill::cli
