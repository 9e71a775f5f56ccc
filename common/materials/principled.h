// A material of layers as people know it from Blender and glTF: a coat over a mixture of metal, glass and a glossy
// plastic.
//
// With c = coat, m = metallic, t = transmission:
//   f = c·coat + T·(m·metal + (1 − m)(t·glass + (1 − t)·(gloss + T'·diffuse)))
// metal, gloss and coat are GGX with Schlick's Fresnel term, f0 = base colour for metal,
// ((ior − 1)/(ior + 1))² · 2·specular for gloss, .04 for the coat; glass is a rough dielectric whose refraction has the
// base colour. T and T' are what a layer leaves to those below, from its directional albedo E, so that no energy is
// made and all of it is reciprocal: T' = (1 − E(wo))(1 − E(wi))/(1 − E_mean), so that a white diffuse base under gloss
// reflects all (Kelemen and Szirmay-Kalos 2001); T = (1 − cE(wo))(1 − cE(wi))/(1 − cE_least), at most 1 − cE(wo).
#pragma once

#include "common/materials/ggx_albedo.h"
#include "common/materials/rough_dielectric.h"

namespace lightmill {

struct PrincipledParameters8 {
  V8 base_color;
  F8 metallic, roughness, specular, transmission;  ///< each in [0, 1]; roughness is √α; specular .5 is what ior says
  F8 ior;                                          ///< of what is behind the outward normal
  F8 coat, coat_roughness;                         ///< each in [0, 1]
};

/// Lanes whose α is below ggx::kSmoothAlpha have delta lobes beside the others: they are drawn, but neither evaluated
/// nor part of the pdf. One lobe is drawn by its albedo; eval and pdf are those of all that are not delta.
class Principled8 {
 public:
  static constexpr bool kTransmits = true, kHasLobes = true, kLosesSamples = true;

  /// `front`: wo is on the side of the outward normal; `eta`: index of refraction beyond the surface over that on wo's
  /// side.
  Principled8(const PrincipledParameters8& p, F8 eta, const V8& wo, M8 front);

  V8 eval(const V8& wo, const V8& wi) const;
  F8 pdf_solid_angle(const V8& wo, const V8& wi) const;
  BsdfSample8 sample(const V8& wo, Pair8 u, F8 choice) const;
  /// `f`: Fresnel's of the glass, of wo; or what is to stand for it.
  SmoothLobes8 smooth(const V8& wo, const dielectric::Fresnel8& f) const;
  /// How much of an even light from all sides the lobes scatter to wo that are not delta. Rough glass counts by its
  /// base colour; what is below a coat is taken to be diffuse.
  V8 rough_albedo() const;

 private:
  /// What of the light the coat leaves to the layers below, on the way in and out.
  F8 coat_leaves(const V8& wi) const;
  /// Of metal and plastic together.
  V8 gloss_fresnel(F8 cos_o) const;
  F8 coat_fresnel(F8 cos_o) const;
  void set_probabilities();

  struct Drawn8 {
    V8 wi;
    V8 smooth_weight;  ///< of a delta lobe
    M8 smooth;
    M8 valid;  ///< the lobe exists in this direction
    M8 through;
  };
  Drawn8 draw(const V8& wo, Pair8 u, F8 choice) const;

  const GgxAlbedo* albedo_;
  V8 base_;
  F8 alpha_, coat_alpha_;
  F8 metal_, plastic_, glass_;  ///< shares
  F8 f0_, f90_;                 ///< of the plastic's gloss
  F8 coat_, coat_beyond_;       ///< on wo's side, and on the other one of glass
  GgxAlbedo::Terms8 terms_;     ///< of gloss, from wo
  F8 gloss_albedo_, gloss_albedo_mean_;
  F8 coat_albedo_, coat_least_;
  RoughDielectric8 glass_bsdf_;
  bool has_glass_, has_coat_;                  ///< in any lane
  F8 p_diffuse_, p_gloss_, p_glass_, p_coat_;  ///< probabilities, together 1 where anything is reflected
};

}  // namespace lightmill
