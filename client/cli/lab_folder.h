// The folder of an experiment: results, references, pictures and the report.
//
//   results.jsonl    what was measured, a JSON object a line: what a later run goes on from
//   references/      KEY.exr, rendered references
//   pictures/        of the first seed
//   charts/          the report's, as files of their own
//   report.html, results.csv, results.json
#pragma once

#include <filesystem>

#include "client/cli/lab_plan.h"
#include "client/lab/report.h"
#include "common/base/file_lock.h"
#include "common/image/image.h"

namespace lightmill::cli {

/// A scene's reference.
struct LabReference {
  RgbImage picture;
  double rel_mse = -1;  ///< that it states of itself; negative: it does not
  std::string text;     ///< what it is
};

class LabFolder {
 public:
  /// Makes the folder if need be and reads the results in it. FAILED_PRECONDITION while another lab works there.
  static Result<LabFolder> open(const std::filesystem::path& path);

  const lab::ResultSet& results() const { return results_; }
  /// Stores one more, at once.
  Status add(const LabPlan& plan, lab::LabResult result);
  /// Compares what was made elsewhere; the references are there.
  Status measure_others(const LabPlan& plan, const std::vector<LabReference>& references);
  /// Where a scene's rendered reference is kept.
  std::filesystem::path reference_path(const LabSceneJob& scene) const;
  /// The reference of a scene, which is there.
  Result<LabReference> load_reference(const LabSceneJob& scene) const;
  /// Keeps a picture under a name, and where it differs.
  Status keep_picture(const std::string& name, const RgbImage& picture, const RgbImage& reference) const;
  /// Writes report.html, its charts, results.csv and results.json of what is there. `references` by scene; the picture
  /// of one that is not there is empty.
  Status write_report(const LabPlan& plan, const std::vector<LabReference>& references) const;
  std::filesystem::path report_path() const { return path_ / "report.html"; }

 private:
  std::filesystem::path path_;
  FileLock lock_;
  lab::ResultSet results_;
};

}  // namespace lightmill::cli
