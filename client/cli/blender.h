// Scenes of Blender, by way of the glTF that it exports.
#pragma once

#include <filesystem>

#include "client/cli/signals.h"
#include "common/scene_io/load.h"

namespace lightmill::cli {

/// Runs Blender without a window on a .blend file and loads what it exports: the active scene with its modifiers
/// applied, its active camera, its picture size, and its world if that has one colour. Scripts within the file are not
/// run. Notices say what is left out. Blender is LIGHTMILL_BLENDER if that is set, else `blender` on the PATH; an error
/// says so if there is none. Stops with Cancelled when interrupted.
Result<LoadedScene> load_blend(const std::filesystem::path& path, const LoadOptions& options, Signals& signals);

}  // namespace lightmill::cli
