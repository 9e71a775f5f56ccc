#include "common/scene_io/scene_bounds.h"

#include "common/base/check.h"
#include "common/scene/compiled/convert.h"
#include "common/scene/compiled/transform.h"
#include "common/scene/mesh.h"

namespace lightmill {
namespace {

/// The bounds in the shape's own coordinates. Empty for a plane.
Bounds box_of(const Object& object, const LoadedScene& loaded) {
  Bounds box;
  if (const auto* sphere = std::get_if<SphereShape>(&object.shape)) {
    box.add(to_vec(sphere->center) - sphere->radius);
    box.add(to_vec(sphere->center) + sphere->radius);
  } else if (const auto* triangle = std::get_if<TriangleShape>(&object.shape)) {
    for (const Point3d& p : {triangle->a, triangle->b, triangle->c}) {
      box.add(to_vec(p));
    }
  } else if (const auto* shape = std::get_if<MeshShape>(&object.shape)) {
    const Result<Mesh> mesh = decode_mesh(as_byte_view(loaded.assets.at(shape->asset)));
    LM_CHECK(mesh.ok(), "{}", message_of(mesh.status()));
    for (const Point3d& p : mesh->positions) {
      box.add(to_vec(p));
    }
  }
  return box;
}

}  // namespace

Vec3d corner_of(const Bounds& box, int i) {
  return {(i & 1) != 0 ? box.high.x : box.low.x, (i & 2) != 0 ? box.high.y : box.low.y,
          (i & 4) != 0 ? box.high.z : box.low.z};
}

const Bounds& Boxes::of(const Object& object) {
  const auto* const mesh = std::get_if<MeshShape>(&object.shape);
  if (mesh == nullptr) {
    return other_ = box_of(object, loaded_);
  }
  const auto [found, added] = meshes_.try_emplace(mesh->asset);
  if (added) {
    found->second = box_of(object, loaded_);
  }
  return found->second;
}

Bounds bounds_of(const LoadedScene& loaded) {
  Boxes boxes(loaded);
  Bounds all;
  for (const Object& object : loaded.scene.objects) {
    const Affine map(object.transform);
    if (const Bounds& own = boxes.of(object); !own.empty()) {
      for (int i = 0; i < 8; ++i) {
        all.add(map(corner_of(own, i)));
      }
    }
  }
  return all;
}

}  // namespace lightmill
