// Reader of a glTF mesh's triangles.
#pragma once

#include <optional>

#include "common/scene/mesh.h"
#include "common/scene_io/gltf/gltf_deform.h"
#include "common/scene_io/notices.h"

namespace lightmill {

/// The triangles of meshes[…].primitives[…] in a pose, with the texture coordinates of this set if there is one.
/// `tangents`: with those of the file, if it has some. `deformed`: see count_deformed. Nothing after an error. Nothing
/// also without triangles (points, lines), which gives a notice. v is flipped: it grows upwards (mesh.h), but downwards
/// in glTF.
std::optional<Mesh> read_primitive(const GltfData& data, const JsonNode& primitive, const MeshPose& pose,
                                   std::optional<std::uint64_t> texture_set, bool tangents, std::uint64_t& deformed,
                                   Notices& notices);

}  // namespace lightmill
