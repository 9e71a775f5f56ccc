// Options that select a command's scene, and the check of its images.
#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>
#include <vector>

#include "client/cli/signals.h"
#include "common/base/status.h"
#include "common/image/decoder/decoder_process.h"
#include "common/scene_io/load.h"

namespace lightmill::cli {

/// The options as typed.
struct SceneOptions {
  std::vector<std::string> scenes;
  std::string camera;
  std::string mtl;
  std::string sky = "auto";
  std::optional<double> at;  ///< seconds
  std::string animation;
  std::optional<int> bake_size;  ///< texels along a side of an image that Blender bakes; without: kBakeSize
  bool strict = false;
  bool unsandboxed_images = false;
};

void add_scene_options(CLI::App& command, SceneOptions& options);

/// Loads the scene, also from Blender. Errors are in the user's files or options. CANCELLED when interrupted.
Result<LoadedScene> load_scene(const SceneOptions& options, Signals& signals);

/// Decodes each image of the scene as a worker does, with the same program. Adds notices about images that are not used
/// as their files say. Fails for an image that cannot be rendered, and names its place. Without images it does nothing.
Status check_images(DecoderProcess& decoder, LoadedScene& loaded, const Signals& signals);

}  // namespace lightmill::cli
