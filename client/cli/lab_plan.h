// A prepared experiment: scenes are loaded, and jobs have keys made of all that decides their pictures.
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
  PreparedJob job;  ///< of the first method; other jobs differ in method, seed and goal
  std::string reference_key;
};

/// One job. It reaches its levels one after the other.
struct LabRun {
  std::size_t scene = 0;
  std::string method;
  std::uint64_t seed = 0;
  std::vector<std::string> level_keys;  ///< keys of its results
  std::string picture;                  ///< base name of its picture's files
};

/// A picture of another program.
struct LabOther {
  lab::OtherPicture picture;
  std::size_t scene = 0;
  std::size_t level = 0;  ///< its index among those of its scene, maker and seed
  std::string key;
  std::string kept;    ///< base name of the files of its scene's and maker's picture on the page
  bool shown = false;  ///< whether the page shows this picture
};

struct LabPlan {
  lab::Experiment experiment;
  std::vector<std::string> notices;  ///< possible mistakes
  std::vector<LabSceneJob> scenes;
  std::vector<LabRun> runs;  ///< in render order: by seed first, so that early reports have everything

  std::vector<LabOther> others;  ///< by scene, maker, seed and samples

  /// The job specification of a run at a level.
  JobSpec spec_of(const LabRun& run, std::size_t level) const;
  /// The job specification of a scene's reference.
  JobSpec reference_spec(const LabSceneJob& scene) const;
  /// The keys of all wanted results, by scene, method, seed and level, then those of other programs. Levels after the
  /// end of a run that reached its maximum of samples are left out.
  std::vector<std::string> wanted(const lab::ResultSet& results) const;
  /// The range [first, end) of a run's levels that are wanted and missing.
  std::pair<std::size_t, std::size_t> missing(const LabRun& run, const lab::ResultSet& results) const;
};

/// Reads the document and all its scenes. Errors name the place in the user's files.
Result<LabPlan> make_lab_plan(const std::string& experiment_file, Signals& signals);

}  // namespace lightmill::cli
