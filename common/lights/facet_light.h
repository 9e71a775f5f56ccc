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
  float exponent = 0;   ///< radiance falls off with this power of the cosine
  bool closed = false;  ///< one of a closed surface: from outside, its back is behind others
};

/// Facets are sampled uniformly by area; triangles so near that this varies much, uniformly by solid angle.
class FacetLights {
 public:
  void add(const EmissiveFacet& facet);
  std::size_t size() const { return corner_.size(); }
  LightBounds bounds(std::size_t i) const;

  LightSample8 sample(const V8& p, U8 index, M8 lanes, Pair8 u) const;

  /// On surfaces at p with unit normals n, if nothing is in the way, of all facets, whose exponents must be 0:
  /// Lambert's formula for what of a facet is above the surface; those that are small and far as points, which is right
  /// to 1e-3. Of closed surfaces the outer side counts alone.
  V8 irradiance(const V8& p, const V8& n, M8 lanes) const;

  /// Density per solid angle at `from` of a point that `sample` draws, found by a ray of this length whose angle to the
  /// facet's normal has this positive cosine.
  F8 pdf_solid_angle(const V8& from, U8 index, F8 distance, F8 cos_light, M8 lanes) const;

 private:
  Vec3d irradiance_of(std::size_t i, const Vec3d& p, const Vec3d& n) const;
  /// Triangles of `lanes` that are to be sampled by solid angle, with what that needs.
  struct Spherical {
    M8 lanes;
    V8 a, b, c;  ///< unit directions to the corners
    F8 solid_angle;
  };
  Spherical spherical(const V8& p, const V8& corner, const V8& edge1, const V8& edge2, M8 triangles) const;

  VectorRows corner_, edge1_, edge2_;
  SurfaceEmission emission_;
  std::vector<std::uint32_t> parallelogram_, closed_;
  bool has_triangles_ = false;
};

}  // namespace lightmill
