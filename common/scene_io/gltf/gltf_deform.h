// Deformation of a glTF primitive's vertices by morph targets and skins.
#pragma once

#include "common/scene/mesh.h"
#include "common/scene_io/gltf/gltf_pose.h"

namespace lightmill {

/// The vertices of a primitive: the accessors' elements that its triangles use. Primitives often share accessors and
/// use few of their elements each.
struct GltfVertices {
  std::size_t count = 0;            ///< of elements in each accessor
  std::vector<std::uint32_t> used;  ///< which of them, ascending
};

/// Whether an attribute has an element for each vertex. Reports an error if not.
bool has_all(const GltfData& data, const JsonNode& attribute, std::string_view what, const GltfVertices& vertices);

/// Work to deform all meshes of a file: vertices and triangles, times the arrays that are read for each.
inline constexpr std::uint64_t kMaxDeformed = 100'000'000;

/// Adds the work of a primitive to `deformed`. False, with an error, if it is too much. Each deformed copy is a mesh of
/// its own.
bool count_deformed(const JsonNode& primitive, const MeshPose& pose, std::size_t vertices, std::size_t triangles,
                    std::uint64_t& deformed);

/// Adds the weighted vectors of the primitive's morph targets for an attribute, as POSITION, to its vectors.
void add_morph_targets(const GltfData& data, const JsonNode& primitive, std::string_view attribute,
                       const MeshPose& pose, const GltfVertices& vertices, std::vector<std::array<double, 3>>& vectors);

/// Moves each vertex, its normal and its tangent by the weighted mean of its joints' maps (glTF 2.0, 3.7.3.3), or with
/// the node if the primitive has no joints. Maps that mirror keep the outer side outside.
void move_with_joints(const GltfData& data, const JsonNode& primitive, const MeshPose& pose,
                      const GltfVertices& vertices, Mesh& mesh);

}  // namespace lightmill
