// A search for the surfaces that pass through a meter's place, and for their precision.
#pragma once

#include <vector>

#include "common/scene/compiled/mesh_sources.h"
#include "common/scene/compiled/transform.h"
#include "common/scene/compiled/world_frame.h"
#include "common/scene/document.h"

namespace lightmill {

/// A meter's place in the frame: a point, or a parallelogram.
struct MeterFootprint {
  Vec3d corner{0}, edge1{0}, edge2{0};

  std::array<Vec3d, 4> corners() const { return {corner, corner + edge1, corner + edge2, corner + edge1 + edge2}; }
  /// The point of the spot that is nearest to p.
  Vec3d nearest(const Vec3d& p) const;
  /// The sum of the magnitudes in its coordinates.
  Vec3d sizes() const { return glm::abs(corner) + glm::abs(edge1) + glm::abs(edge2); }
};

/// Searches a scene's objects. It keeps references to its arguments.
class MeterSurfaces {
 public:
  /// `maps` and `bounds` (in scene units): one per object.
  MeterSurfaces(const Scene& scene, const ObjectMeshes& meshes, const std::vector<Affine>& maps,
                const std::vector<Bounds>& bounds, const WorldFrame& frame)
      : scene_(scene), meshes_(meshes), maps_(maps), bounds_(bounds), frame_(frame) {}

  /// The magnitudes in the coordinates of hits near a meter on a surface. They are those of the meter, and of surfaces
  /// that pass through it within rounding. Zero for a meter on no surface. Its estimates begin at its place.
  Vec3d magnitude(const MeterFootprint& footprint) const;

 private:
  Vec3d to_frame(std::size_t object, const Vec3d& p) const { return frame_.to_frame(maps_[object](p)); }
  Vec3d on_sphere(std::size_t object, const SphereShape& sphere, const MeterFootprint& footprint) const;
  Vec3d on_plane(std::size_t object, const PlaneShape& plane, const MeterFootprint& footprint) const;
  Vec3d on_mesh(std::size_t object, const MeterFootprint& footprint) const;

  const Scene& scene_;
  const ObjectMeshes& meshes_;
  const std::vector<Affine>& maps_;
  const std::vector<Bounds>& bounds_;
  const WorldFrame& frame_;
};

}  // namespace lightmill
