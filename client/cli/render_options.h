// Options of `render` and `submit`, and the job made of them.
#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <string>

#include "client/cli/scene_options.h"
#include "common/base/status.h"
#include "common/farm/job.h"
#include "common/scene_io/load.h"

namespace lightmill::cli {

struct RenderOptions {
  RenderOptions() { spec.settings.method = "auto"; }

  SceneOptions scene;
  std::string size, crop, layers;  ///< as typed; make_job reads them together with the scene
  bool brute_force = false;
  bool denoise = false;   ///< add the layer `features`
  std::string png_layer;  ///< add this layer; empty: none
  JobSpec spec;           ///< values of the other options
};

/// Used when none of --spp, --seconds and --error is given.
inline constexpr std::uint64_t kDefaultSamples = 64;

void add_render_options(CLI::App& command, RenderOptions& options);

/// A job ready to submit, with the assets of its scene.
struct PreparedJob {
  JobSpec spec;
  LoadedScene scene;
};

/// Loads the scene and checks every option against it. Errors name the option or the place in the file.
Result<PreparedJob> make_job(const RenderOptions& options, Signals& signals);

}  // namespace lightmill::cli
