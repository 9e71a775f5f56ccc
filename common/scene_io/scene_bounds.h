// Bounds of a loaded scene and its objects.
#pragma once

#include <map>

#include "common/scene/compiled/world_frame.h"
#include "common/scene_io/load.h"

namespace lightmill {

/// Corner 0 to 7 of a box.
Vec3d corner_of(const Bounds& box, int i);

/// Bounds of objects, in their own coordinates. Those of meshes are computed once. The scene must outlive it.
class Boxes {
 public:
  explicit Boxes(const LoadedScene& loaded) : loaded_(loaded) {}
  /// Empty for a plane. Valid until the next call.
  const Bounds& of(const Object& object);

 private:
  const LoadedScene& loaded_;
  std::map<Sha256, Bounds> meshes_;
  Bounds other_;
};

/// Bounds of all objects but planes, in the scene's coordinates.
Bounds bounds_of(const LoadedScene& loaded);

}  // namespace lightmill
