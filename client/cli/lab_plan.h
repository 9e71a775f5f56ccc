// An experiment made ready: its scenes loaded, its jobs named by what decides their pictures.
#pragma once

#include <string>
#include <vector>

#include "client/cli/render_options.h"
#include "client/lab/experiment.h"
#include "client/lab/results.h"

namespace lightmill::cli {

/// One scene of an experiment.
struct LabSceneJob {
  lab::LabScene scene;
  PreparedJob job;  ///< of the first method; others differ in method, seed and goal
  std::string reference_key;
};

/// One job: its levels are reached one after the other.
struct LabRun {
  std::size_t scene = 0;
  std::string method;
  std::uint64_t seed = 0;
  std::vector<std::string> level_keys;  ///< of the results
  std::string picture;                  ///< name of its picture's files, without their endings
};

/// A picture from elsewhere.
struct LabOther {
  lab::OtherPicture picture;
  std::size_t scene = 0;
  std::size_t level = 0;  ///< its place among those of its scene, maker and seed
  std::string key;
  std::string kept;    ///< name of the files of its scene's and maker's picture on the page
  bool shown = false;  ///< whether it is that one
};

struct LabPlan {
  lab::Experiment experiment;
  std::vector<std::string> notices;  ///< what may be a mistake
  std::vector<LabSceneJob> scenes;
  std::vector<LabRun> runs;  ///< in the order in which they are rendered: by seed first, so that early reports have all

  std::vector<LabOther> others;  ///< by scene, maker, seed and samples

  /// What the job of a run is given at a level.
  JobSpec spec_of(const LabRun& run, std::size_t level) const;
  /// The job of a scene's reference.
  JobSpec reference_spec(const LabSceneJob& scene) const;
  /// The keys of all results that are wanted, by scene, method, seed and level, then those from elsewhere; less those
  /// of levels whose run has ended before, at its most samples.
  std::vector<std::string> wanted(const lab::ResultSet& results) const;
  /// The levels of a run that are wanted and not there: [first, end).
  std::pair<std::size_t, std::size_t> missing(const LabRun& run, const lab::ResultSet& results) const;
};

/// Reads the document and all of its scenes. Errors are the user's to mend and name the place.
Result<LabPlan> make_lab_plan(const std::string& experiment_file, Signals& signals);

}  // namespace lightmill::cli
