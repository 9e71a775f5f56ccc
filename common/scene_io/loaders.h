// Loaders of scene documents, OBJ files and single meshes. load_scene chooses between them and the
// readers of other formats.
#pragma once

#include "common/scene_io/load.h"

namespace lightmill {

inline constexpr std::uint64_t kMaxDocumentBytes = std::uint64_t{64} << 20;
inline constexpr std::uint64_t kMaxFileBytes = std::uint64_t{4} << 30;  ///< of other files

/// Loads a scene document with the meshes and other files that it names.
Result<LoadedScene> load_document(const std::filesystem::path& path, const SceneFiles& files);

/// Loads OBJ files with their materials. Adds a camera, and a sky if nothing lights the scene and `add_sky_if_unlit` is
/// set.
Result<LoadedScene> load_objs(std::span<const std::filesystem::path> paths, KaMeaning ka, bool add_sky_if_unlit,
                              const SceneFiles& files);

/// Loads a PLY or STL file: one diffuse object, with the colours of its vertices. Adds the same.
Result<LoadedScene> load_mesh_file(const std::filesystem::path& path, bool add_sky_if_unlit, const SceneFiles& files);

}  // namespace lightmill
