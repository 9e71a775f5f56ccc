// Emissive objects as single points: what methods without random numbers are lit by. Their shadows are hard.
//
// The point is the centre of the object's bounding box and has its power, of a texture that of the image's mean. With Σ
// A n the sum of its facets' normals by area, an object of area A and radiance L cosⁿθ shines as A L cosⁿ⁺¹θ about
// their mean: for a Lambertian emitter with intensity Φ/π along the normal. This is exact from afar for what is flat.
// What emits on both sides does so about both normals, however its parts are wound. Where the normals cancel the object
// shines equally in all directions, and so do spheres; what is closed, by its outer side alone.
#pragma once

#include <map>

#include "common/lights/cosine_power_light.h"
#include "common/lights/facet_light.h"
#include "common/lights/point_light.h"
#include "common/lights/sphere_light.h"

namespace lightmill {

/// Sums over the facets of one object, which have the same radiance, sides and exponent.
class FacetSums {
 public:
  /// `closed`: the facet's part has an inside, which is not seen.
  void add(const EmissiveFacet& facet, bool closed);

 private:
  friend class HardLights;
  struct Part {
    Vec3d area_normal{0};  ///< Σ area · normal
    double area = 0;
    bool closed = false;
  };
  struct Total {
    Vec3d area_normal{0};  ///< with the parts of what emits on both sides turned so that they do not cancel
    double area = 0;
    double shining_area = 0;  ///< with both sides of what shines on both
  };
  Total total() const;

  Vec3d low_{0}, high_{0};
  std::map<std::uint32_t, Part> parts_;  ///< by EmissiveFacet::part
  Vec3d radiance_{0};
  double exponent_ = 0;
  bool two_sided_ = false;
};

/// Built by its adds, then immutable. Objects are known by the index of their geometry.
class HardLights {
 public:
  void add(std::uint32_t geometry, const FacetSums& facets);
  void add(std::uint32_t geometry, const EmissiveSphere& sphere);

  std::size_t size() const { return geometry_.size(); }
  std::uint32_t geometry(std::size_t i) const { return geometry_[i]; }
  /// The point that is light i, as seen from p.
  LightSample8 sample(std::size_t i, const V8& p, M8 lanes) const;
  std::uint64_t bytes() const { return size() * 48; }

 private:
  void add_point(std::uint32_t geometry, const PointEmitter& point);
  void add_cosine_power(std::uint32_t geometry, const CosinePowerEmitter& emitter);

  std::vector<std::uint32_t> geometry_;
  std::vector<std::uint32_t> row_;  ///< of cosine_powers_, or kPoint + that of points_
  static constexpr std::uint32_t kPoint = 0x80000000;
  PointLights points_;
  CosinePowerLights cosine_powers_;
};

}  // namespace lightmill
