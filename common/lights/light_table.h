// All lights of a scene in one table: what next-event estimation draws from, and with which density.
//
// A light primitive is an emissive triangle or parallelogram, an emissive sphere or a point light; one of them is
// chosen with probability proportional to its power. The same densities answer for light that a scattered ray finds by
// itself (multiple importance sampling). Immutable once built, thread-safe.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "common/math/vec.h"
#include "common/sampling/discrete.h"
#include "common/sampling/warp.h"

namespace lightmill {

/// A triangle, or the parallelogram that two of them form: it is sampled as one, which keeps the points of a pair
/// stratified.
struct EmissiveFacet {
  Vec3 corner, edge1, edge2;  ///< emits to the side of edge1 × edge2
  Vec3 radiance;              ///< W/(m² sr)
  bool two_sided = false;
  bool parallelogram = false;
};
struct EmissiveSphere {
  Vec3 center;
  float radius = 0;
  Vec3 radiance;
  bool inward = false;  ///< emits towards the centre
  bool two_sided = false;
};
struct PointEmitter {
  Vec3 position;
  Vec3 intensity;  ///< W/sr
};

/// A point on a light as seen from a shading point.
struct LightSample8 {
  V8 point;            ///< where, moved a hair off the light's surface
  V8 wi;               ///< unit direction to it
  V8 weight;           ///< radiance over pdf_solid_angle; for a point light intensity / (distance² · probability)
  F8 pdf_solid_angle;  ///< 0 for point lights
  M8 valid;            ///< there is light from there
};

class LightTable {
 public:
  void add(const EmissiveFacet& facet) { facets_.push_back(facet); }
  void add(const EmissiveSphere& sphere) { spheres_.push_back(sphere); }
  void add(const PointEmitter& point) { points_.push_back(point); }
  /// After the last add.
  void build();

  bool empty() const { return !choice_.has_value(); }
  std::size_t size() const { return facets_.size() + spheres_.size() + points_.size(); }

  /// Draws a light and a point on it for each shading point.
  LightSample8 sample(const V8& shading_point, F8 choice, Pair8 u) const;

  /// Probability per area with which `sample` finds a point on a facet of this radiance.
  float facet_pdf_area(const Vec3& radiance, bool two_sided) const;
  float sphere_choice_probability(const EmissiveSphere& sphere) const;

 private:
  enum Kind : std::uint32_t { kFacet, kSphere, kPoint };
  void push(Kind kind, const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& radiance, bool flip, bool two_sided,
            bool parallelogram);
  LightSample8 sample_facets(const V8& p, U8 index, M8 lanes, F8 pmf, Pair8 u) const;
  LightSample8 sample_spheres(const V8& p, U8 index, M8 lanes, F8 pmf, Pair8 u) const;
  LightSample8 sample_points(const V8& p, U8 index, M8 lanes, F8 pmf) const;

  std::vector<EmissiveFacet> facets_;
  std::vector<EmissiveSphere> spheres_;
  std::vector<PointEmitter> points_;

  // One row per primitive; facets: a corner and two edges; spheres: centre, radius in b.x; points: position.
  std::optional<DiscreteDistribution> choice_;
  std::vector<std::uint32_t> kind_, flip_, two_sided_, parallelogram_;
  std::vector<float> a_, b_, c_, radiance_;  ///< 3 floats a row
  double total_power_ = 0;
};

/// Density per solid angle, seen from `from`, of a point of a sphere as `LightTable::sample` draws it: uniform in the
/// cone that the sphere fills from outside, uniform by area from inside.
F8 sphere_pdf_solid_angle(const V8& from, const V8& center, F8 radius, F8 distance, F8 cos_light);

/// How far to move a point off a surface with unit normal `n` so that a ray from it cannot find the surface again. Each
/// coordinate is off by a few rounding errors of `magnitude`, the sizes that entered it (positions, the ray's way, the
/// triangle's extent); only what of that lies along the normal matters.
inline F8 surface_offset(const V8& n, const V8& magnitude) {
  return F8(0x1p-19f) * (abs(n.x) * magnitude.x + abs(n.y) * magnitude.y + abs(n.z) * magnitude.z);
}

}  // namespace lightmill
