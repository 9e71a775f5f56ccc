// Positions of objects that receive light, as far as the document and small meshes tell.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <variant>
#include <vector>

#include "common/math/vec.h"
#include "common/planner/scene_facts.h"
#include "common/scene/mesh.h"

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

/// Finds positions in one scene. It reads each mesh once. Its work has a limit, so a hostile scene takes a fraction of
/// a second. Positions beyond the limit are unknown.
class Positions {
 public:
  /// A step is a comparison of a light with a region, two bytes of a mesh, or a third of a triangle.
  static constexpr std::uint64_t kMaxSteps = 20'000'000;

  /// Both must outlive this.
  Positions(const Scene& scene, const MeshSource& meshes)
      : scene_(scene), meshes_(meshes), extents_(scene.objects.size()) {}

  /// Extent of a sphere, a triangle or a readable mesh of the scene.
  const std::optional<Extent>& extent_of(const Object& object);

  /// Positions of all objects that scatter narrowly; empty if one is unknown.
  Regions narrow_regions();
  /// The same for all objects and surface meters that receive light.
  Regions receiver_regions();

  /// Whether an emitter of this extent is small from each of these positions. Its own position is left out, and at
  /// least one other must remain. `emitter`: null for lights, which are no objects.
  bool is_small_from(const Regions& regions, const Object* emitter, const Extent& extent);

  /// Whether light of a spot goes straight to one of these positions, as far as is known.
  bool reaches(const SpotLight& light, const Regions& regions);

  std::uint64_t steps() const { return steps_; }

 private:
  /// False if so many steps are too many.
  bool take(std::uint64_t steps);
  /// Null if it is unknown.
  const Mesh* mesh(const Sha256& asset);
  std::optional<Extent> find_extent(const Object& object);
  std::optional<Extent> find_extent(const Object& object, const MeshShape& shape);
  template <class Counts>
  std::optional<Regions> regions_of(const Counts& counts);

  const Scene& scene_;
  const MeshSource& meshes_;
  std::uint64_t steps_ = 0;
  std::map<Sha256, std::optional<Mesh>> decoded_;
  std::vector<std::optional<std::optional<Extent>>> extents_;  ///< of each object, once it was asked for
};

}  // namespace lightmill
