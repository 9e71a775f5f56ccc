// The meshes of a scene's objects, as they are to be rendered.
#pragma once

#include <memory>
#include <vector>

#include "common/scene/compiled/compiled_scene.h"
#include "common/scene/compiled/transform.h"
#include "common/scene/compiled/world_frame.h"

namespace lightmill {

/// One an object: null for what is no mesh, shared by objects that name one asset.
using ObjectMeshes = std::vector<std::shared_ptr<const Mesh>>;

/// Fails where an asset is missing or damaged, or the scene has too many triangles; errors name the object.
Result<ObjectMeshes> load_meshes(const Scene& scene, const CompiledScene::AssetSource& assets);

/// The mesh under a map: normals stay unit vectors, and the outer side of a mirrored mesh its outer side.
Mesh transformed(const Mesh& mesh, const Affine& map);

/// Bounds of the mesh under a map.
Bounds bounds_of(const Mesh& mesh, const Affine& map);

}  // namespace lightmill
