// Where things of a scene are that light comes to, as far as the document and small meshes tell.
#pragma once

#include <optional>
#include <variant>
#include <vector>

#include "common/math/vec.h"
#include "common/planner/scene_facts.h"

namespace lightmill {

/// A shape whose place is known: what it fills of the directions from afar is area / (4π d²) at most.
struct Extent {
  Vec3d center{0};
  double radius = 0;  ///< of a sphere around it
  double area = 0;    ///< across
};

/// Where something is that light of a lamp comes to.
struct Place {
  std::variant<Extent, PlaneShape> shape;
  bool hollow = false;             ///< a sphere
  const Object* object = nullptr;  ///< null: a meter

  /// No more than how far it is from a point.
  double distance(const Vec3d& p) const;
};

using Places = std::vector<Place>;

/// Of a sphere, a triangle or a mesh that can be read.
std::optional<Extent> extent_of(const Object& object, const MeshSource& meshes);

/// Of all objects that scatter narrowly; none where the place of one is not known.
Places narrow_places(const Scene& scene, const MeshSource& meshes);
/// The same of all that receives light, meters of surfaces among it.
Places receiving_places(const Scene& scene, const MeshSource& meshes);

/// Whether there are such places but for the lamp's own, and a lamp of this extent is small as seen from each.
bool is_small_from(const Places& places, const Object& lamp, const Extent& extent);

/// Whether some of a spot light goes straight to one of these places, as far as is known.
bool reaches(const SpotLight& light, const Places& places);

}  // namespace lightmill
