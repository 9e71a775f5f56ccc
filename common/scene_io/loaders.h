// One loader for each kind of scene file. load_scene chooses between them.
#pragma once

#include "common/scene_io/load.h"

namespace lightmill {

inline constexpr std::uint64_t kMaxDocumentBytes = std::uint64_t{64} << 20;

/// Loads a scene document with the meshes and other files that it names.
Result<LoadedScene> load_document(const std::filesystem::path& path, const SceneFiles& files);

/// Loads OBJ files with their materials. Adds a camera, and a sky if nothing lights the scene and `light_the_dark` is set.
Result<LoadedScene> load_objs(std::span<const std::filesystem::path> paths, KaMeaning ka, bool light_the_dark,
                              const SceneFiles& files);

/// Loads a glTF file and the files that it names (gltf/gltf.h).
Result<LoadedScene> load_gltf(const std::filesystem::path& path, bool light_the_dark, const SceneFiles& files);

/// Loads a pbrt scene and the files that it names (pbrt/pbrt.h).
Result<LoadedScene> load_pbrt(const std::filesystem::path& path, const SceneFiles& files);

/// Loads a Mitsuba scene and the files that it names (mitsuba/mitsuba.h).
Result<LoadedScene> load_mitsuba(const std::filesystem::path& path, const SceneFiles& files);

}  // namespace lightmill
