// lightmill lab EXPERIMENT -o DIR
#include <nlohmann/json.hpp>

#include "client/cli/context.h"
#include "client/cli/farm_choice.h"
#include "client/cli/film_fetch.h"
#include "client/cli/follow.h"
#include "client/cli/lab_folder.h"
#include "client/cli/lab_plan.h"
#include "client/cli/progress.h"
#include "client/cli/submission.h"
#include "client/cli/table.h"
#include "client/cli/units.h"
#include "common/base/number_text.h"
#include "common/base/text_width.h"

namespace lightmill::cli {
namespace {

constexpr const char* kLabFooter =
    "EXPERIMENT is a JSON document with scenes, methods, seeds, numbers of samples or errors, and a reference.\n"
    "docs/guide/lab.md describes it. The farm is chosen as for `render`. DIR gets report.html (charts of error\n"
    "against time, speed-ups, pictures), the charts as files, results.csv and results.json. Ctrl-C keeps finished\n"
    "results. The same command resumes from them.";

struct LabOptions {
  std::string experiment, folder;
  bool local = false;
  unsigned threads = 0;
};

/// Renders the missing results of an experiment.
class Lab {
 public:
  Lab(const LabPlan& plan, LabFolder& folder, Farm& farm, Signals& signals, const Console& console)
      : plan_(plan), folder_(folder), farm_(farm), signals_(signals), console_(console), started_(now()) {
    for (const LabRun& run : plan.runs) {
      runs_left_ += pending(run);
    }
    runs_ = runs_left_;
  }

  /// Makes missing references, then all runs. Fills `references` scene by scene.
  Status run(std::vector<LabReference>& references) {
    for (std::size_t s = 0; s < plan_.scenes.size(); ++s) {
      LM_ASSIGN_OR_RETURN(references[s], reference_of(plan_.scenes[s]));
    }
    for (const LabRun& one : plan_.runs) {
      if (pending(one)) {
        LM_RETURN_IF_ERROR(render(one, references[one.scene].picture));
        --runs_left_;
      }
    }
    return ok_status();
  }

 private:
  static Time now() { return system_clock().now(); }

  bool pending(const LabRun& run) const {
    const auto [first, end] = plan_.missing(run, folder_.results());
    return first < end;
  }

  /// The remaining time of all runs, from those that are done. Empty before the first.
  std::string eta_text() const {
    const std::size_t done = runs_ - runs_left_;
    if (done == 0) {
      return "";
    }
    const double each = to_seconds(now() - started_) / static_cast<double>(done);
    return ", " + human_seconds(each * static_cast<double>(runs_left_)) + " left";
  }

  /// Follows the job to its goal. Deletes it from the farm on failure.
  Result<v1::Job> follow(std::uint64_t id, const std::string& label) {
    Result<v1::Job> job = follow_job(farm_, id, false, signals_, console_, [&](const v1::WatchJobResponse& response) {
      if (console_.terminal() && !console_.json()) {
        constexpr int kProgress = 24;  // columns
        const int width = console_.width() - 3;
        std::string text = fmt::format("[{}/{}{}] ", runs_ - runs_left_, runs_, eta_text());
        text += shortened(label, std::max(width - columns_of(text) - kProgress, 1)) + ": ";
        text += progress_text(response.job(), width - columns_of(text));
        console_.redraw(cut_to_columns(text, width));
      }
    });
    if (job.ok() && job->state() != v1::JOB_STATE_DONE) {
      return failed_precondition("{}: the job is {}: {}", label, state_name(job->state()), job->reason());
    }
    return job;
  }

  /// Deletes the job, so that the farm does not fill with unused films.
  void forget(std::uint64_t id, bool running) { (void)farm_.connection->delete_job(id, running); }

  Result<v1::Job> submit(const LabSceneJob& scene, JobSpec spec, const std::string& label) {
    PreparedJob job{std::move(spec), {}};
    job.spec.request_id += fmt::format("-{}", ++submitted_);
    job.spec.name = as_job_name(label);
    job.scene.assets = scene.job.scene.assets;
    return with_context(submit_job(*farm_.connection, job, console_), label);
  }

  static std::string as_job_name(const std::string& label);

  Result<LabReference> reference_of(const LabSceneJob& scene) {
    const lab::Reference& reference = scene.scene.reference;
    std::error_code error;
    if (reference.file.empty() && !std::filesystem::exists(folder_.reference_path(scene), error)) {
      const std::string label = fmt::format("{}, reference by {}", scene.scene.name, reference.method);
      LM_ASSIGN_OR_RETURN(const v1::Job submitted, submit(scene, plan_.reference_spec(scene), label));
      const Result<v1::Job> job = follow(submitted.id(), label);
      Result<AssembledFilm> film = job.ok() ? fetch_film(*farm_.connection, submitted.id()) : job.status();
      forget(submitted.id(), !job.ok());
      LM_RETURN_IF_ERROR(film.status());
      LM_RETURN_IF_ERROR(write_outputs(film->picture, {{folder_.reference_path(scene).string()}}));
      console_.progress(fmt::format("{}: {} of thread time", label, human_seconds(job->worker_seconds())));
    }
    return folder_.load_reference(scene);
  }

  Status render(const LabRun& run, const RgbImage& reference) {
    const LabSceneJob& scene = plan_.scenes[run.scene];
    const std::string label = fmt::format("{}, {}, seed {}", scene.scene.name, run.method, run.seed);
    LM_ASSIGN_OR_RETURN(const v1::Job submitted,
                        submit(scene, plan_.spec_of(run, plan_.missing(run, folder_.results()).first), label));
    const Status status = reach_levels(run, submitted.id(), reference, label);
    forget(submitted.id(), !status.ok());
    if (status.ok()) {
      const std::size_t done = runs_ - runs_left_ + 1;
      console_.progress(fmt::format("[{}/{}] {}: {}", done, runs_, label, last_text(run)));
    }
    return status;
  }

  std::string last_text(const LabRun& run) const {
    const std::size_t end = plan_.missing(run, folder_.results()).second;
    const lab::LabResult& last = folder_.results().at(run.level_keys[end - 1]);
    return fmt::format("{} samples, {} of thread time, relMSE {}", last.samples, human_seconds(last.thread_seconds),
                       significant(last.error.rel_mse, 3));
  }

  Status reach_levels(const LabRun& run, std::uint64_t id, const RgbImage& reference, const std::string& label) {
    for (bool first = true;; first = false) {
      const auto [level, end] = plan_.missing(run, folder_.results());
      if (level == end) {
        return ok_status();
      }
      if (!first) {
        const Goal goal = plan_.spec_of(run, level).goal;
        LM_RETURN_IF_ERROR(farm_.connection->extend_job(id, goal.error > 0 ? 0 : goal.samples, goal.error).status());
      }
      LM_RETURN_IF_ERROR(follow(id, label).status());
      LM_ASSIGN_OR_RETURN(const AssembledFilm film, fetch_film(*farm_.connection, id));
      LM_RETURN_IF_ERROR(measure(run, level, film, reference));
    }
  }

  Status measure(const LabRun& run, std::size_t level, const AssembledFilm& film, const RgbImage& reference) {
    const RgbImage picture = cropped_frame(film.picture);
    lab::LabResult result;
    result.key = run.level_keys[level];
    result.scene = plan_.scenes[run.scene].scene.name;
    result.method = run.method;
    result.seed = run.seed;
    result.level = level;
    result.samples = film.picture.receipt.min_samples;
    result.thread_seconds = film.job.worker_seconds();
    result.seconds = film.job.active_seconds();
    LM_RETURN_IF_ERROR(lab::compare(picture, reference, result));
    result.stated = film.picture.receipt.rel_mse;
    result.stated_half_width = film.picture.receipt.rel_mse_half_width;
    result.film_hash = film.picture.receipt.film_hash;
    if (run.seed == plan_.experiment.seeds.front()) {
      LM_RETURN_IF_ERROR(folder_.keep_picture(run.picture, picture, reference));
    }
    return folder_.add(plan_, std::move(result));
  }

  const LabPlan& plan_;
  LabFolder& folder_;
  Farm& farm_;
  Signals& signals_;
  const Console& console_;
  Time started_;
  std::size_t runs_ = 0, runs_left_ = 0;
  std::uint64_t submitted_ = 0;
};

std::string Lab::as_job_name(const std::string& label) {
  return "lab: " + label.substr(0, 150);
}

/// The existing references, so that a report can be written without a farm.
std::vector<LabReference> references_there(const LabPlan& plan, const LabFolder& folder) {
  std::vector<LabReference> references(plan.scenes.size());
  for (std::size_t s = 0; s < plan.scenes.size(); ++s) {
    if (Result<LabReference> reference = folder.load_reference(plan.scenes[s]); reference.ok()) {
      references[s] = std::move(*reference);
    }
  }
  return references;
}

/// Whether anything has to be rendered.
bool needs_farm(const LabPlan& plan, const LabFolder& folder, const std::vector<LabReference>& references) {
  const auto pending = [&](const LabRun& run) {
    const auto [first, end] = plan.missing(run, folder.results());
    return first < end;
  };
  return std::ranges::any_of(plan.runs, pending) ||
         std::ranges::any_of(references, [](const LabReference& one) { return one.picture.pixels() == 0; });
}

Result<ExitCode> run_lab(Context& context, const Console& console, const LabOptions& options) {
  LM_ASSIGN_OR_RETURN(const LabPlan plan, make_lab_plan(options.experiment, context.signals));
  for (const std::string& notice : plan.notices) {
    console.notice(notice);
  }
  LM_ASSIGN_OR_RETURN(LabFolder folder, LabFolder::open(options.folder));
  std::vector<LabReference> references = references_there(plan, folder);
  Status status;
  if (needs_farm(plan, folder, references)) {
    LM_ASSIGN_OR_RETURN(Farm farm,
                        choose_farm(context.common, options.local, {options.threads}, context.signals, console));
    status = Lab(plan, folder, farm, context.signals, console).run(references);
  }
  if (status.ok()) {
    status = folder.measure_others(plan, references);
  }
  const Status written = folder.write_report(plan, references);
  const std::vector<std::string> wanted = plan.wanted(folder.results());
  const auto done =
      std::ranges::count_if(wanted, [&](const std::string& key) { return folder.results().contains(key); });
  if (!status.ok()) {
    console.notice(fmt::format("{} of {} in {}. The same command resumes from them", done,
                               counted(wanted.size(), "result"), options.folder));
    return console.fail(status);
  }
  if (!written.ok()) {
    return console.fail(written);
  }
  console.object(
      nlohmann::json{{"folder", options.folder}, {"results", done}, {"report", folder.report_path().string()}});
  console.result(
      fmt::format("{}: {}", folder.report_path().string(), counted(static_cast<std::size_t>(done), "result")));
  return kDone;
}

}  // namespace

void add_lab_command(CLI::App& app, Context& context) {
  const auto options = std::make_shared<LabOptions>();
  CLI::App* command = app.add_subcommand("lab", "Compare methods on scenes: error against time, as one page.");
  command->footer(kLabFooter);
  command->add_option("EXPERIMENT", options->experiment, "a JSON document")->type_name("FILE")->required();
  command->add_option("-o,--output", options->folder, "folder for results and report; made if needed")
      ->required()
      ->type_name("DIR");
  add_local_farm_options(*command, options->local, options->threads);
  add_common_options(*command, context);
  command->callback([&context, options] {
    context.run = [&context, options](const Console& console) { return run_lab(context, console, *options); };
  });
}

}  // namespace lightmill::cli
