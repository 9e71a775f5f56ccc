// The meshes of a scene's objects, as they are to be rendered.
#pragma once

#include <memory>
#include <vector>

#include "common/scene/compiled/compiled_scene.h"
#include "common/scene/compiled/transform.h"
#include "common/scene/compiled/world_frame.h"

namespace lightmill {

/// Meshes with fewer triangles are copied for each object rather than instanced.
inline constexpr std::uint32_t kInstancedTriangles = 64;

struct ObjectMeshes {
  /// One an object: null for what is no mesh, shared by objects that name one asset.
  std::vector<std::shared_ptr<const Mesh>> of_object;
  /// One an object: whether it is rendered as an instance of its mesh, else as a copy. Emitters are copied, as light
  /// sampling wants their triangles one by one; so are small meshes, which is faster to trace.
  std::vector<bool> instanced;
  std::uint64_t triangles_held = 0;  ///< a mesh counts once for all its instances, and once for each copy
  std::uint64_t triangles_seen = 0;  ///< a mesh counts once for each object
};

/// Fails where an asset is missing or damaged, or more than `max_triangles` are to be held; errors name the object.
Result<ObjectMeshes> load_meshes(const Scene& scene, const CompiledScene::AssetSource& assets,
                                 std::uint64_t max_triangles = kMaxSceneTriangles);

/// The mesh under a map: normals stay unit vectors, and the outer side of a mirrored mesh its outer side.
Mesh transformed(const Mesh& mesh, const Affine& map);

/// Bounds of the mesh under a map.
Bounds bounds_of(const Mesh& mesh, const Affine& map);
/// Bounds of a box under a map.
Bounds bounds_of(const Bounds& box, const Affine& map);

}  // namespace lightmill
