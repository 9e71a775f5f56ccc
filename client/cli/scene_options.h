// Which scene a command is about.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "client/cli/signals.h"
#include "common/base/status.h"
#include "common/scene_io/load.h"

namespace lightmill::cli {

/// As typed.
struct SceneOptions {
  std::vector<std::string> scenes;
  std::string camera;
  std::string mtl;
  bool unsandboxed_images = false;
};

void add_scene_options(CLI::App& command, SceneOptions& options);

/// Loads the scene, of Blender too; errors are the user's to mend. Cancelled when interrupted.
Result<LoadedScene> load_scene(const SceneOptions& options, Signals& signals);

}  // namespace lightmill::cli
