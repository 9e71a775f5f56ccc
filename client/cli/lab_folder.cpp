#include "client/cli/lab_folder.h"

#include "client/cli/console.h"
#include "client/lab/page.h"
#include "common/base/file.h"
#include "common/base/number_text.h"
#include "common/image/film_picture.h"
#include "common/image/picture_file.h"

namespace lightmill::cli {
namespace fs = std::filesystem;
namespace {

Status write(const fs::path& path, const std::string& bytes) {
  return as_output_error(write_file_atomically(path, as_byte_view(bytes)));
}

/// The file's bytes; empty if it cannot be read.
std::string bytes_if_there(const fs::path& path) {
  return read_file(path).value_or("");
}

std::string reference_text(const lab::Reference& reference) {
  if (!reference.file.empty()) {
    return fs::path(reference.file).filename().string();
  }
  return fmt::format("{}, seed {}, {}", reference.method, reference.seed,
                     reference.samples > 0 ? fmt::format("{} samples per pixel", reference.samples)
                                           : fmt::format("to error {:g}", reference.error));
}

}  // namespace

Result<LabFolder> LabFolder::open(const fs::path& path) {
  LabFolder folder;
  folder.path_ = path;
  for (const char* name : {"", "references", "pictures", "charts"}) {
    std::error_code error;
    fs::create_directories(path / name, error);
    if (error) {
      return invalid_argument("cannot make the folder {}: {}. Choose another one", (path / name).string(),
                              error.message());
    }
  }
  LM_ASSIGN_OR_RETURN(
      folder.lock_,
      FileLock::acquire(path / "lock", fmt::format("another lab uses {}: wait until it ends, or choose another folder "
                                                   "with -o",
                                                   path.string())));
  const fs::path file = path / "results.jsonl";
  if (const Status status = check_can_write(file); !status.ok()) {
    return invalid_argument("{}", message_of(status));
  }
  if (std::error_code error; !fs::exists(file, error)) {
    return folder;
  }
  LM_ASSIGN_OR_RETURN(const std::string text, read_file(file));
  LM_ASSIGN_OR_RETURN(folder.results_, with_context(lab::read_lines(text), file.string()));
  return folder;
}

Status LabFolder::add(const LabPlan& plan, lab::LabResult result) {
  results_[result.key] = std::move(result);
  return write(path_ / "results.jsonl", lab::write_lines(results_, plan.wanted(results_)));
}

fs::path LabFolder::reference_path(const LabSceneJob& scene) const {
  return path_ / "references" / (scene.reference_key.substr(0, 16) + ".exr");
}

Result<LabReference> LabFolder::load_reference(const LabSceneJob& scene) const {
  const std::string& given = scene.scene.reference.file;
  LabReference reference;
  reference.text = reference_text(scene.scene.reference);
  LM_ASSIGN_OR_RETURN(reference.picture, load_rgb(given.empty() ? reference_path(scene) : fs::path(given)));
  const RenderSettings& settings = scene.job.spec.settings;
  if (reference.picture.width != settings.width || reference.picture.height != settings.height) {
    return invalid_argument("scene {}: its reference {} has {}x{} pixels, its pictures {}x{}", scene.scene.name,
                            reference.text, reference.picture.width, reference.picture.height, settings.width,
                            settings.height);
  }
  // A file of another program has no error estimate.
  if (const Result<FilmPicture> film = load_film_picture(given.empty() ? reference_path(scene) : fs::path(given));
      film.ok()) {
    reference.rel_mse = film->receipt.rel_mse;
  }
  return reference;
}

Status LabFolder::measure_others(const LabPlan& plan, const std::vector<LabReference>& references) {
  for (const LabOther& other : plan.others) {
    if (results_.contains(other.key)) {
      continue;
    }
    const lab::OtherPicture& made = other.picture;
    const RgbImage& reference = references[other.scene].picture;
    LM_ASSIGN_OR_RETURN(const RgbImage picture, load_rgb(made.file));
    lab::LabResult result;
    LM_RETURN_IF_ERROR(with_context(lab::compare(picture, reference, result), made.file));
    result.key = other.key;
    result.scene = made.scene;
    result.method = made.method;
    result.seed = made.seed;
    result.level = other.level;
    result.samples = made.samples;
    result.thread_seconds = made.seconds;
    result.seconds = made.wall;
    if (other.shown) {
      LM_RETURN_IF_ERROR(keep_picture(other.kept, picture, reference));
    }
    LM_RETURN_IF_ERROR(add(plan, std::move(result)));
  }
  return ok_status();
}

Status LabFolder::keep_picture(const std::string& name, const RgbImage& picture, const RgbImage& reference) const {
  LM_ASSIGN_OR_RETURN(const std::string plain, lab::picture_png(picture));
  LM_ASSIGN_OR_RETURN(const std::string difference, lab::difference_png(picture, reference));
  LM_RETURN_IF_ERROR(write(path_ / "pictures" / (name + ".png"), plain));
  return write(path_ / "pictures" / (name + "-difference.png"), difference);
}

Status LabFolder::write_report(const LabPlan& plan, const std::vector<LabReference>& references) const {
  lab::ReportInput input;
  input.experiment = plan.experiment;
  for (const LabOther& other : plan.others) {
    std::vector<std::string>& methods = input.experiment.methods;
    if (std::ranges::find(methods, other.picture.method) == methods.end()) {
      methods.push_back(other.picture.method);
    }
  }
  const std::vector<std::string> wanted = plan.wanted(results_);
  input.wanted = wanted.size();
  for (const std::string& key : wanted) {
    if (const auto found = results_.find(key); found != results_.end()) {
      input.results.push_back(found->second);
    }
  }
  const auto picture_of = [&](const lab::LabResult& result, const std::string& name) {
    return lab::ReportPicture{
        fmt::format("{}, {} samples, relMSE {}", result.method, result.samples, significant(result.error.rel_mse, 3)),
        bytes_if_there(path_ / "pictures" / (name + ".png")),
        bytes_if_there(path_ / "pictures" / (name + "-difference.png"))};
  };
  for (std::size_t s = 0; s < plan.scenes.size(); ++s) {
    lab::ReportScene scene{plan.scenes[s].scene.name, references[s].rel_mse, references[s].text, {}};
    if (references[s].picture.pixels() > 0) {
      LM_ASSIGN_OR_RETURN(std::string png, lab::picture_png(references[s].picture));
      scene.pictures.push_back({"reference: " + references[s].text, std::move(png), ""});
    }
    for (const LabRun& run : plan.runs) {
      const std::size_t end = plan.missing(run, results_).first;
      if (run.scene != s || run.seed != plan.experiment.seeds.front() || end == 0) {
        continue;
      }
      scene.pictures.push_back(picture_of(results_.at(run.level_keys[end - 1]), run.picture));
    }
    for (const LabOther& other : plan.others) {
      if (const auto found = results_.find(other.key); other.scene == s && other.shown && found != results_.end()) {
        scene.pictures.push_back(picture_of(found->second, other.kept));
      }
    }
    input.scenes.push_back(std::move(scene));
  }
  LM_RETURN_IF_ERROR(write(path_ / "results.csv", lab::to_csv(input.results)));
  LM_RETURN_IF_ERROR(write(path_ / "results.json", lab::report_json(input)));
  for (const lab::ReportChart& chart : lab::report_charts(input)) {
    LM_RETURN_IF_ERROR(write(path_ / "charts" / chart.name, chart.svg));
  }
  return write(report_path(), lab::report_html(input));
}

}  // namespace lightmill::cli
