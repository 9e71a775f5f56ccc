// Options that select a command's scene.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "client/cli/signals.h"
#include "common/base/status.h"
#include "common/scene_io/load.h"

namespace lightmill::cli {

/// The options as typed.
struct SceneOptions {
  std::vector<std::string> scenes;
  std::string camera;
  std::string mtl;
  std::string sky = "auto";
  bool strict = false;
  bool unsandboxed_images = false;
};

void add_scene_options(CLI::App& command, SceneOptions& options);

/// Loads the scene, also from Blender. Errors are in the user's files or options. CANCELLED when interrupted.
Result<LoadedScene> load_scene(const SceneOptions& options, Signals& signals);

}  // namespace lightmill::cli
