// Emissive triangles and parallelograms.
#pragma once

#include <map>

#include "common/lights/light_sample.h"
#include "common/lights/surface_emission.h"
#include "common/materials/texture.h"

namespace lightmill {

/// Texture of a facet, which multiplies its radiance.
struct FacetTexture {
  std::uint32_t number = TextureSet::kNone;         ///< in FacetLights' textures
  std::array<float, 2> corner{}, edge1{}, edge2{};  ///< coordinates at the corner, and their changes along the edges
};

/// A triangle, or a parallelogram of two triangles, which is sampled as one so that its points stay stratified.
struct EmissiveFacet {
  Vec3 corner, edge1, edge2;  ///< emits to the side of edge1 × edge2
  Vec3 radiance;              ///< W/(m² sr) along the normal, multiplied by the texture
  bool two_sided = false;
  bool parallelogram = false;
  float exponent = 0;           ///< radiance falls off with this power of the cosine
  std::uint32_t part = kAlone;  ///< connected part of one radiance; only for two-sided facets
  bool flipped = false;         ///< its normal is on the other side of the part than the first facet's

  FacetTexture texture = {};

  static constexpr std::uint32_t kAlone = 0xffffffff;
};

/// Facets are sampled uniformly by area. Triangles near the point, whose solid angle per area varies much, are sampled
/// uniformly by solid angle.
class FacetLights {
 public:
  /// The textures that facets refer to. Call it before `add`.
  void set_textures(const TextureSet& textures) { textures_ = textures; }
  void add(const EmissiveFacet& facet);
  std::size_t size() const { return corner_.size(); }
  LightBounds bounds(std::size_t i) const;
  /// Without its texture.
  EmissiveFacet facet(std::size_t i) const;
  /// Radiance along the normal, times the mean of the texture.
  Vec3d mean_radiance(std::size_t i) const;

  LightSample8 sample(const V8& p, U8 index, M8 lanes, Pair8 u) const;
  /// Uniform by area.
  EmissionPoint8 emission_point(U8 index, M8 lanes, Pair8 u) const;
  /// Without its texture. `cos_light`: cosine between direction and normal, not negative.
  V8 radiance(U8 index, F8 cos_light, M8 lanes) const { return emission_.radiance(index, cos_light, lanes); }

  /// Density per solid angle at `from` of a point of `sample`, hit by a ray of this length. `cos_light`: cosine to the
  /// facet's normal, positive.
  F8 pdf_solid_angle(const V8& from, U8 index, F8 distance, F8 cos_light, M8 lanes) const;

 private:
  V8 texture_at(U8 index, M8 lanes, Pair8 place) const;
  /// Lanes whose triangles are sampled by solid angle, with what this needs.
  struct Spherical {
    M8 lanes;
    V8 a, b, c;  ///< unit directions to the corners
    F8 solid_angle;
  };
  Spherical spherical(const V8& p, const V8& corner, const V8& edge1, const V8& edge2, M8 triangles) const;

  /// Lanes with parallelograms.
  M8 is_whole(U8 index, M8 lanes) const {
    return has_triangles_ ? gather(parallelogram_.data(), index, lanes) == U8(1u) : lanes;
  }

  VectorRows corner_, edge1_, edge2_;
  VectorRows normal_;           ///< unit
  std::vector<float> density_;  ///< 1 / area
  SurfaceEmission emission_;
  std::vector<std::uint32_t> parallelogram_, part_;
  std::vector<std::uint8_t> flipped_;
  bool has_triangles_ = false;

  // One row per facet, if any facet has a texture.
  bool has_textures_ = false;
  TextureSet textures_;
  std::map<std::uint32_t, Vec3d> means_;  ///< by texture
  std::vector<std::uint32_t> texture_;
  std::vector<float> coordinates_;  ///< FacetTexture's, 6 each
};

}  // namespace lightmill
