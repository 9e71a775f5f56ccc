// What `render` and `submit` are told, and the job that it makes.
#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <string>
#include <vector>

#include "client/cli/scene_options.h"
#include "common/base/status.h"
#include "common/farm/job.h"
#include "common/scene_io/load.h"

namespace lightmill::cli {

struct RenderOptions {
  RenderOptions() { spec.settings.method = "auto"; }

  SceneOptions scene;
  std::string size, crop, layers;  ///< as typed: make_job reads them beside the scene
  bool brute_force = false;
  JobSpec spec;  ///< what the other options say
};

/// Used when none of --spp, --seconds and --error is given.
inline constexpr std::uint64_t kDefaultSamples = 64;

void add_render_options(CLI::App& command, RenderOptions& options);

/// A job ready to submit, with the assets that its scene names.
struct PreparedJob {
  JobSpec spec;
  LoadedScene scene;
};

/// Loads the scene and checks every option against it; errors name the option or the place in the file.
Result<PreparedJob> make_job(const RenderOptions& options, Signals& signals);

}  // namespace lightmill::cli
