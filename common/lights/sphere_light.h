// Emissive spheres.
#pragma once

#include "common/lights/light_sample.h"
#include "common/lights/surface_emission.h"

namespace lightmill {

struct EmissiveSphere {
  Vec3 center;
  float radius = 0;
  Vec3 radiance;        ///< W/(m² sr) along the normal
  bool inward = false;  ///< emits towards the centre
  bool two_sided = false;
  float exponent = 0;  ///< radiance falls off with this power of the cosine
};

/// From outside, spheres are sampled uniformly in the cone that they subtend. From inside, uniformly by area.
class SphereLights {
 public:
  void add(const EmissiveSphere& sphere);
  std::size_t size() const { return center_.size(); }
  LightBounds bounds(std::size_t i) const;
  static bool has_size(std::size_t /*i*/) { return true; }

  LightSample8 sample(const V8& p, U8 index, M8 lanes, Pair8 u) const;
  /// The point with this outward unit normal. Its `area` is that of the whole sphere.
  EmissionPoint8 emission_point(U8 index, M8 lanes, const V8& outward) const;
  V8 center(U8 index, M8 lanes) const { return center_.at(index, lanes); }
  F8 radius(U8 index, M8 lanes) const { return gather(radius_.data(), index, lanes); }
  /// Lanes whose spheres shine only outward.
  M8 outward_only(U8 index, M8 lanes) const {
    return and_not(lanes & (gather(inward_.data(), index, lanes) == U8(0u)), emission_.two_sided(index, lanes));
  }
  /// `cos_light`: cosine between direction and normal, not negative.
  V8 radiance(U8 index, F8 cos_light, M8 lanes) const { return emission_.radiance(index, cos_light, lanes); }

  /// Irradiance on a surface at p with unit normal n, without occlusion. The sphere's exponent must be 0.
  Vec3d irradiance(std::size_t i, const Vec3d& p, const Vec3d& n) const;

  /// Whether light from the sphere can reach some of another sphere. It cannot if that lies inside and this one shines
  /// only outward.
  bool can_reach(std::size_t i, const Vec3d& center, double radius) const;

  /// Density per solid angle at `from` of a point of `sample`, hit by a ray of this length. `cos_light`: cosine to the
  /// sphere's normal, positive.
  F8 pdf_solid_angle(const V8& from, U8 index, F8 distance, F8 cos_light, M8 lanes) const;

 private:
  VectorRows center_;
  SurfaceEmission emission_;
  std::vector<float> radius_;
  std::vector<std::uint32_t> inward_;
};

}  // namespace lightmill
