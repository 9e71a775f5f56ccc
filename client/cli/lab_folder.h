// Folder of an experiment: results, references, pictures and the report.
//   results.jsonl    measurements, one JSON object a line, from which a later run resumes
//   references/      KEY.exr, rendered references
//   pictures/        those of the first seed
//   charts/          the report's charts as files
//   report.html, results.csv, results.json
#pragma once

#include <filesystem>

#include "client/cli/lab_plan.h"
#include "client/lab/report.h"
#include "common/base/file_lock.h"
#include "common/image/image.h"

namespace lightmill::cli {

/// A scene's reference picture.
struct LabReference {
  RgbImage picture;
  double rel_mse = -1;  ///< its own error estimate; negative: none
  std::string text;     ///< a description
};

class LabFolder {
 public:
  /// Makes the folder if needed, and reads its results. FAILED_PRECONDITION while another lab uses it.
  static Result<LabFolder> open(const std::filesystem::path& path);

  const lab::ResultSet& results() const { return results_; }
  /// Adds a result, and stores it at once.
  Status add(const LabPlan& plan, lab::LabResult result);
  /// Compares the pictures of other programs with the references, which must exist.
  Status measure_others(const LabPlan& plan, const std::vector<LabReference>& references);
  /// The path of a scene's rendered reference.
  std::filesystem::path reference_path(const LabSceneJob& scene) const;
  /// Loads the reference of a scene. It must exist.
  Result<LabReference> load_reference(const LabSceneJob& scene) const;
  /// Stores a picture under a name, and its difference from the reference.
  Status keep_picture(const std::string& name, const RgbImage& picture, const RgbImage& reference) const;
  /// Writes report.html, its charts, results.csv and results.json from the results so far. `references` are by scene. A
  /// missing one has an empty picture.
  Status write_report(const LabPlan& plan, const std::vector<LabReference>& references) const;
  std::filesystem::path report_path() const { return path_ / "report.html"; }

 private:
  std::filesystem::path path_;
  FileLock lock_;
  lab::ResultSet results_;
};

}  // namespace lightmill::cli
