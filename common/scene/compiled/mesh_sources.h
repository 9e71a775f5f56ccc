// The meshes of a scene's objects, ready for rendering.
#pragma once

#include <memory>
#include <vector>

#include "common/scene/compiled/compiled_scene.h"
#include "common/scene/compiled/transform.h"
#include "common/scene/compiled/world_frame.h"

namespace lightmill {

/// Meshes with fewer triangles are copied for each object instead of instanced.
inline constexpr std::uint32_t kInstancedTriangles = 64;

struct ObjectMeshes {
  /// One per object: null if it is not a mesh. Objects with the same asset share it.
  std::vector<std::shared_ptr<const Mesh>> of_object;
  /// One per object: whether it is an instance of its mesh, else it is a copy. Emitters are copied because light
  /// sampling needs their triangles one by one. Small meshes are copied because copies trace faster.
  std::vector<bool> instanced;
  std::uint64_t triangles_held = 0;  ///< a mesh counts once for all its instances, and once for each copy
  std::uint64_t triangles_seen = 0;  ///< a mesh counts once for each object
};

/// Fails if an asset is missing or damaged, or if more than `max_triangles` would be held. Errors name the object.
Result<ObjectMeshes> load_meshes(const Scene& scene, const CompiledScene::AssetSource& assets,
                                 std::uint64_t max_triangles = kMaxSceneTriangles);

/// The mesh under a map. Normals stay unit vectors. A mirrored mesh keeps its outer side.
Mesh transformed(const Mesh& mesh, const Affine& map);

/// Bounds of the mesh under a map.
Bounds bounds_of(const Mesh& mesh, const Affine& map);
/// Bounds of a box under a map.
Bounds bounds_of(const Bounds& box, const Affine& map);

}  // namespace lightmill
