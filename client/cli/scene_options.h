// Which scene a command is about.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "common/base/status.h"
#include "common/scene_io/load.h"

namespace lightmill::cli {

/// As typed.
struct SceneOptions {
  std::vector<std::string> scenes;
  std::string camera;
  std::string mtl;
};

void add_scene_options(CLI::App& command, SceneOptions& options);

/// Loads the scene; errors are the user's to mend.
Result<LoadedScene> load_scene(const SceneOptions& options);

}  // namespace lightmill::cli
