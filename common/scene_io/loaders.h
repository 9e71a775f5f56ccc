// Loaders of scene documents and OBJ files. load_scene chooses between them and the readers of other formats.
#pragma once

#include "common/scene_io/load.h"

namespace lightmill {

inline constexpr std::uint64_t kMaxDocumentBytes = std::uint64_t{64} << 20;

/// Loads a scene document with the meshes and other files that it names.
Result<LoadedScene> load_document(const std::filesystem::path& path, const SceneFiles& files);

/// Loads OBJ files with their materials. Adds a camera, and a sky if nothing lights the scene and `add_sky_if_unlit` is
/// set.
Result<LoadedScene> load_objs(std::span<const std::filesystem::path> paths, KaMeaning ka, bool add_sky_if_unlit,
                              const SceneFiles& files);

}  // namespace lightmill
