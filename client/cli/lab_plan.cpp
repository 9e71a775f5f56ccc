#include "client/cli/lab_plan.h"

#include <filesystem>

#include "client/cli/console.h"
#include "common/base/file.h"
#include "common/image/picture_file.h"
#include "common/methods/spec/method_spec.h"

namespace lightmill::cli {
namespace fs = std::filesystem;
namespace {

constexpr std::uint64_t kMaxExperimentBytes = 16 << 20;
/// Raised when the meaning of a result changes.
constexpr const char* kResultVersion = "lightmill-lab-1";

Goal goal_of(std::uint64_t samples, double error) {
  Goal goal;
  goal.samples = samples;
  goal.error = error;
  return goal;
}

/// SHA-256 of what decides a picture and its reference.
std::string key_of(const JobSpec& spec, const std::string& reference) {
  const RenderSettings& settings = spec.settings;
  Sha256Hasher hasher;
  hasher.append(fmt::format("{}\n{}\n{}\n", kResultVersion, settings.renderer_version, sha256(*settings.scene).hex()));
  for (const Sha256& asset : *settings.assets) {
    hasher.append(asset.hex() + "\n");
  }
  hasher.append(fmt::format("{}x{}\n{}\nseed {}\nsamples {}\nerror {}\nreference {}\n", settings.width, settings.height,
                            settings.method, settings.seed, spec.goal.samples, spec.goal.error, reference));
  return hasher.finish().hex();
}

Status check_method(const std::string& method, const std::string& place) {
  const Result<MethodSpec> spec = parse_method(method);
  return spec.ok() ? ok_status() : with_context(spec.status(), place);
}

Result<LabSceneJob> prepare(const lab::LabScene& scene, const lab::Experiment& experiment, Signals& signals) {
  RenderOptions options;
  options.scene.scenes = scene.files;
  options.scene.camera = scene.camera;
  options.spec.settings.method = experiment.methods.empty() ? "path" : experiment.methods.front();
  options.spec.goal.samples = 1;
  if (experiment.width > 0) {
    options.size = fmt::format("{}x{}", experiment.width, experiment.height);
  }
  LM_ASSIGN_OR_RETURN(PreparedJob job, with_context(make_job(options, signals), "scene " + scene.name));
  job.spec.settings.meters = 0;  // the lab shows no readings, so it renders no meters
  return LabSceneJob{scene, std::move(job), ""};
}

/// Reads the pictures of other programs, and gives each its level.
Status add_others(LabPlan& plan) {
  const std::string& file = plan.experiment.others;
  const Result<std::string> text = read_file(file, kMaxExperimentBytes);
  LM_RETURN_IF_ERROR(as_input_error(text.status()));
  Result<std::vector<lab::OtherPicture>> pictures = lab::parse_others(*text, fs::path(file).parent_path());
  LM_RETURN_IF_ERROR(with_context(pictures.status(), file));
  std::ranges::stable_sort(*pictures, {}, [](const lab::OtherPicture& one) {
    return std::tuple(one.scene, one.method, one.seed, one.samples);
  });
  for (lab::OtherPicture& made : *pictures) {
    const auto scene =
        std::ranges::find(plan.scenes, made.scene, [](const LabSceneJob& job) { return job.scene.name; });
    if (scene == plan.scenes.end()) {
      return invalid_argument("{}: the experiment has no scene {}", file, made.scene);
    }
    const Result<std::string> bytes = read_file(made.file);
    LM_RETURN_IF_ERROR(as_input_error(bytes.status()));
    LabOther other;
    other.scene = static_cast<std::size_t>(scene - plan.scenes.begin());
    other.key = sha256(fmt::format("{}\nother {} {} {} {} {} {}\n{}\nreference {}\n", kResultVersion, made.scene,
                                   made.method, made.seed, made.samples, made.seconds, made.wall, sha256(*bytes).hex(),
                                   scene->reference_key))
                    .hex();
    other.kept = sha256(fmt::format("{}\n{}", made.scene, made.method)).hex().substr(0, 16);
    other.shown = true;
    if (!plan.others.empty() && plan.others.back().kept == other.kept) {
      LabOther& before = plan.others.back();
      const bool same_seed = before.picture.seed == made.seed;
      other.level = same_seed ? before.level + 1 : 0;
      other.shown = same_seed && before.shown;  // the last of the first seed
      before.shown = before.shown && !same_seed;
    }
    other.picture = std::move(made);
    plan.others.push_back(std::move(other));
  }
  return ok_status();
}

/// The reference's part of keys: the digest of its file, or of all that decides it.
Result<std::string> reference_key(const LabPlan& plan, const LabSceneJob& scene) {
  if (scene.scene.reference.file.empty()) {
    return key_of(plan.reference_spec(scene), "");
  }
  Result<std::string> bytes = read_file(scene.scene.reference.file);
  if (!bytes.ok()) {
    return as_input_error(bytes.status());
  }
  return sha256(*bytes).hex();
}

/// Checks a reference file whose receipt says which samples it holds, as lab::Experiment checks rendered references. A
/// picture of another scene may be intended, so it gives a notice.
Status check_reference_file(const LabSceneJob& scene, LabPlan& plan) {
  const std::string& file = scene.scene.reference.file;
  const Result<FilmPicture> film = load_film_picture(file);
  if (!film.ok() || film->receipt.scene_digest.empty()) {
    return ok_status();  // a file of another program
  }
  if (!plan.experiment.methods.empty() &&
      std::ranges::find(plan.experiment.seeds, film->receipt.seed) != plan.experiment.seeds.end()) {
    return invalid_argument(
        "scene {}: the reference {} has seed {}, which the experiment uses too: render it with another seed",
        scene.scene.name, file, film->receipt.seed);
  }
  if (film->receipt.scene_digest != sha256(*scene.job.spec.settings.scene).hex()) {
    plan.notices.push_back(fmt::format("scene {}: the reference {} is of another scene document, or of another size",
                                       scene.scene.name, file));
  }
  return ok_status();
}

}  // namespace

JobSpec LabPlan::spec_of(const LabRun& run, std::size_t level) const {
  JobSpec spec = scenes[run.scene].job.spec;
  spec.settings.method = run.method;
  spec.settings.seed = run.seed;
  spec.goal = experiment.samples.empty() ? goal_of(experiment.max_samples, experiment.errors[level])
                                         : goal_of(experiment.samples[level], 0);
  return spec;
}

JobSpec LabPlan::reference_spec(const LabSceneJob& scene) const {
  const lab::Reference& reference = scene.scene.reference;
  JobSpec spec = scene.job.spec;
  spec.settings.method = reference.method;
  spec.settings.seed = reference.seed;
  spec.goal = goal_of(reference.samples, reference.error);
  return spec;
}

std::pair<std::size_t, std::size_t> LabPlan::missing(const LabRun& run, const lab::ResultSet& results) const {
  std::size_t first = run.level_keys.size();
  for (std::size_t level = 0; level < run.level_keys.size(); ++level) {
    const auto found = results.find(run.level_keys[level]);
    if (found == results.end()) {
      first = std::min(first, level);
    } else if (experiment.max_samples > 0 && found->second.samples >= experiment.max_samples) {
      return {std::min(first, level + 1), level + 1};  // the run ended before this level
    }
  }
  return {first, run.level_keys.size()};
}

std::vector<std::string> LabPlan::wanted(const lab::ResultSet& results) const {
  std::vector<const LabRun*> sorted;
  for (const LabRun& run : runs) {
    sorted.push_back(&run);
  }
  const auto method_place = [&](const LabRun& run) {
    return std::ranges::find(experiment.methods, run.method) - experiment.methods.begin();
  };
  // Stable, so that seeds keep the experiment's order.
  std::ranges::stable_sort(sorted, {}, [&](const LabRun* run) { return std::pair(run->scene, method_place(*run)); });
  std::vector<std::string> keys;
  for (const LabRun* run : sorted) {
    keys.insert(keys.end(), run->level_keys.begin(),
                run->level_keys.begin() + static_cast<std::ptrdiff_t>(missing(*run, results).second));
  }
  for (const LabOther& other : others) {
    keys.push_back(other.key);
  }
  return keys;
}

Result<LabPlan> make_lab_plan(const std::string& experiment_file, Signals& signals) {
  const Result<std::string> text = read_file(experiment_file, kMaxExperimentBytes);
  if (!text.ok()) {
    return as_input_error(text.status());
  }
  LabPlan plan;
  LM_ASSIGN_OR_RETURN(
      plan.experiment,
      with_context(lab::parse_experiment(*text, fs::path(experiment_file).parent_path()), experiment_file));
  for (std::size_t m = 0; m < plan.experiment.methods.size(); ++m) {
    LM_RETURN_IF_ERROR(
        with_context(check_method(plan.experiment.methods[m], fmt::format("methods[{}]", m)), experiment_file));
  }
  for (const lab::LabScene& scene : plan.experiment.scenes) {
    if (scene.reference.file.empty()) {
      LM_RETURN_IF_ERROR(with_context(check_method(scene.reference.method, "reference.method"), experiment_file));
    }
    LM_ASSIGN_OR_RETURN(LabSceneJob prepared, with_context(prepare(scene, plan.experiment, signals), experiment_file));
    LM_ASSIGN_OR_RETURN(prepared.reference_key, reference_key(plan, prepared));
    if (!scene.reference.file.empty()) {
      LM_RETURN_IF_ERROR(with_context(check_reference_file(prepared, plan), experiment_file));
    }
    plan.scenes.push_back(std::move(prepared));
  }
  for (const std::uint64_t seed : plan.experiment.seeds) {
    for (std::size_t scene = 0; scene < plan.scenes.size(); ++scene) {
      for (const std::string& method : plan.experiment.methods) {
        LabRun run{scene, method, seed, {}, ""};
        for (std::size_t level = 0; level < plan.experiment.levels(); ++level) {
          run.level_keys.push_back(key_of(plan.spec_of(run, level), plan.scenes[scene].reference_key));
        }
        run.picture = run.level_keys.back().substr(0, 16);
        plan.runs.push_back(std::move(run));
      }
    }
  }
  if (!plan.experiment.others.empty()) {
    LM_RETURN_IF_ERROR(add_others(plan));
  }
  return plan;
}

}  // namespace lightmill::cli
