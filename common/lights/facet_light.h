// Emissive triangles and parallelograms.
#pragma once

#include "common/lights/surface_emission.h"

namespace lightmill {

/// A triangle, or the parallelogram that two of them form: it is sampled as one, which keeps the points of a pair
/// stratified.
struct EmissiveFacet {
  Vec3 corner, edge1, edge2;  ///< emits to the side of edge1 × edge2
  Vec3 radiance;              ///< W/(m² sr) along the normal
  bool two_sided = false;
  bool parallelogram = false;
  float exponent = 0;           ///< radiance falls off with this power of the cosine
  std::uint32_t part = kAlone;  ///< what it hangs together with, of one radiance; known of what emits on both sides
  bool flipped = false;         ///< its normal points to the other side of the part than that of the part's first facet

  static constexpr std::uint32_t kAlone = 0xffffffff;
};

/// Facets are sampled uniformly by area; triangles so near that this varies much, uniformly by solid angle.
class FacetLights {
 public:
  void add(const EmissiveFacet& facet);
  std::size_t size() const { return corner_.size(); }
  LightBounds bounds(std::size_t i) const;
  EmissiveFacet facet(std::size_t i) const;

  LightSample8 sample(const V8& p, U8 index, M8 lanes, Pair8 u) const;

  /// Density per solid angle at `from` of a point that `sample` draws, found by a ray of this length whose angle to the
  /// facet's normal has this positive cosine.
  F8 pdf_solid_angle(const V8& from, U8 index, F8 distance, F8 cos_light, M8 lanes) const;

 private:
  /// Triangles of `lanes` that are to be sampled by solid angle, with what that needs.
  struct Spherical {
    M8 lanes;
    V8 a, b, c;  ///< unit directions to the corners
    F8 solid_angle;
  };
  Spherical spherical(const V8& p, const V8& corner, const V8& edge1, const V8& edge2, M8 triangles) const;

  VectorRows corner_, edge1_, edge2_;
  SurfaceEmission emission_;
  std::vector<std::uint32_t> parallelogram_, part_;
  std::vector<std::uint8_t> flipped_;
  bool has_triangles_ = false;
};

}  // namespace lightmill
