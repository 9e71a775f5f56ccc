// Import of Blender scenes, through the glTF that Blender exports.
#pragma once

#include <filesystem>

#include "client/cli/signals.h"
#include "common/scene_io/load.h"

namespace lightmill::cli {

/// Runs Blender without a window on a .blend file, and loads what it exports. This is the active scene with its
/// modifiers applied, the active camera, the picture size, and the world if it has a single colour. Scripts in the file
/// do not run. Notices list what is left out. The program is LIGHTMILL_BLENDER if that is set, else `blender` on the
/// PATH. Without it the error says so. Returns CANCELLED when interrupted.
Result<LoadedScene> load_blend(const std::filesystem::path& path, const LoadOptions& options, Signals& signals);

}  // namespace lightmill::cli
