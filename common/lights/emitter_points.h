// Emissive objects as single points with hard shadows, for deterministic methods.
//
// The point is the centre of the object's bounding box, and has the object's power. A texture counts as its mean. Area
// A and radiance L cosⁿθ give the intensity A L cosⁿ⁺¹θ about the mean normal, which is exact for flat objects from
// afar. If the normals cancel, as those of spheres do, the object emits equally in all directions. Two-sided objects
// emit about both normals, closed ones only on their outer side.
#pragma once

#include <map>

#include "common/lights/cosine_power_light.h"
#include "common/lights/facet_light.h"
#include "common/lights/point_light.h"
#include "common/lights/sphere_light.h"

namespace lightmill {

/// Sums over the facets of an object, which have the same radiance, sides and exponent.
class FacetSums {
 public:
  /// `closed`: the facet belongs to a part with an invisible inside.
  void add(const EmissiveFacet& facet, bool closed);

 private:
  friend class EmitterPoints;
  struct Part {
    Vec3d area_normal{0};  ///< Σ area · normal
    double area = 0;
    bool closed = false;
  };
  struct Total {
    Vec3d area_normal{0};  ///< parts of two-sided objects are turned so that they do not cancel
    double area = 0;
    double shining_area = 0;  ///< both sides of two-sided parts
  };
  Total total() const;

  Vec3d low_{0}, high_{0};
  std::map<std::uint32_t, Part> parts_;  ///< by EmissiveFacet::part
  Vec3d radiance_{0};
  double exponent_ = 0;
  bool two_sided_ = false;
};

/// Built by `add`, then immutable. Objects are identified by the index of their geometry.
class EmitterPoints {
 public:
  void add(std::uint32_t geometry, const FacetSums& facets);
  void add(std::uint32_t geometry, const EmissiveSphere& sphere);

  std::size_t size() const { return geometry_.size(); }
  std::uint32_t geometry(std::size_t i) const { return geometry_[i]; }
  /// The point of light i, as seen from p.
  LightSample8 sample(std::size_t i, const V8& p, M8 lanes) const;
  std::uint64_t bytes() const { return size() * 48; }

 private:
  void add_point(std::uint32_t geometry, const PointEmitter& point);
  void add_cosine_power(std::uint32_t geometry, const CosinePowerEmitter& emitter);

  std::vector<std::uint32_t> geometry_;
  std::vector<std::uint32_t> row_;  ///< row of cosine_powers_, or kPoint + row of points_
  static constexpr std::uint32_t kPoint = 0x80000000;
  PointLights points_;
  CosinePowerLights cosine_powers_;
};

}  // namespace lightmill
