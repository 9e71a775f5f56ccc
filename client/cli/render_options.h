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

/// As typed; parsed by make_job.
struct RenderOptions {
  SceneOptions scene;
  std::string size, crop, seconds, error, method = "auto", layers, name, owner;
  std::uint64_t samples = 0;  ///< 0: not given
  bool adaptive = false;
  std::uint64_t seed = 0;
  std::uint32_t max_bounces = 0;
  bool brute_force = false;
  std::int32_t priority = 0;
  std::string verify = "1%";
  bool allow_mixed = false;
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
