// Positions of objects that receive light, as far as the document and small meshes tell.
#pragma once

#include <optional>
#include <variant>
#include <vector>

#include "common/math/vec.h"
#include "common/planner/scene_facts.h"

namespace lightmill {

/// A shape with a known position. From distance d it fills at most area / (4π d²) of all directions.
struct Extent {
  Vec3d center{0};
  double radius = 0;  ///< of a sphere around it
  double area = 0;    ///< projected
};

/// Position of an object or meter that receives light.
struct Region {
  std::variant<Extent, PlaneShape> shape;
  bool hollow = false;             ///< a sphere
  const Object* object = nullptr;  ///< null: a meter

  /// A lower bound of the distance from a point.
  double distance(const Vec3d& p) const;
};

using Regions = std::vector<Region>;

/// Extent of a sphere, a triangle or a readable mesh.
std::optional<Extent> extent_of(const Object& object, const MeshSource& meshes);

/// Positions of all objects that scatter narrowly; empty if one is unknown.
Regions narrow_regions(const Scene& scene, const MeshSource& meshes);
/// The same for all objects and surface meters that receive light.
Regions receiver_regions(const Scene& scene, const MeshSource& meshes);

/// Whether there are such positions other than the emitter's own, and an emitter of this extent is small from each.
/// `emitter`: null for lights, which are no objects.
bool is_small_from(const Regions& regions, const Object* emitter, const Extent& extent);

/// Whether light of a spot goes straight to one of these positions, as far as is known.
bool reaches(const SpotLight& light, const Regions& regions);

}  // namespace lightmill
