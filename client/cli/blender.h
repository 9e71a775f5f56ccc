// Import of Blender scenes, by an exporter that runs in Blender (client/blender).
#pragma once

#include <filesystem>

#include "client/cli/signals.h"
#include "common/scene_io/load.h"

namespace lightmill::cli {

inline constexpr int kBakeSize = 1024, kMaxBakeSize = 8192;

/// Runs Blender without a window on a .blend file, and loads what the exporter writes: the active scene as Cycles would
/// render it. Scripts in the file do not run. What only Cycles can compute becomes images of `bake_size` texels a side. Notices say what differs. The program is LIGHTMILL_BLENDER if that is
/// set, else `blender` on the PATH. Without it the error says so. Returns CANCELLED when interrupted.
Result<LoadedScene> load_blend(const std::filesystem::path& path, int bake_size, const LoadOptions& options,
                               Signals& signals);

}  // namespace lightmill::cli
