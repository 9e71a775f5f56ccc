// Reader of glTF 2.0 scenes, as text (.gltf) and binary (.glb).
#pragma once

#include "common/scene_io/gltf/gltf_data.h"
#include "common/scene_io/load.h"

namespace lightmill {

struct GltfOptions {
  std::optional<AnimationMoment> moment = {};
  bool add_sky_if_unlit = true;  ///< adds a sky if nothing lights the scene
  MeshDecoder decode_mesh = {};  ///< without one, files with compressed meshes are refused
  /// The most bytes that accessors read, beyond 8 times those of the file's buffers. Accessors may share bytes, and
  /// meshes in many poses read theirs for each.
  std::uint64_t most_shared_bytes = kMaxSharedBytes;
};

/// Reads a glTF file at a moment: the nodes of its scene with their meshes (instances share theirs), materials
/// (gltf_materials.h), images inside and outside the file, punctual lights and perspective cameras. The first camera is
/// the scene's. Without a camera, the scene gets one that sees all of it. The sky is the soft one of missing_parts.h.
/// Notices report both, and what was left out. Errors read "model.gltf: accessors[3].count: …".
Result<LoadedScene> read_gltf(std::string bytes, const std::string& file_name, const GltfOptions& options,
                              FileSource files);

}  // namespace lightmill
