// Principled BSDF, as in Blender and glTF: a coat over a mixture of metal, glass and glossy plastic. Metal and plastic
// can have a sheen.
//
// With c = coat, m = metallic, t = transmission:
//   f = c·coat + T·(m·metal + (1 − m)(t·glass + (1 − t)·(gloss + T'·diffuse)))
// metal, gloss and coat are GGX. Metal has Schlick's Fresnel term, with the base colour at normal incidence. Gloss and
// coat have Fresnel's equations for a dielectric, the coat with index 1.5. glass is a rough dielectric whose refraction
// has the base colour.
//
// `specular` below .5 scales the gloss by 2·specular. Above, it raises the index, so that the reflectance at normal
// incidence is f0 = ((ior − 1)/(ior + 1))² · 2·specular. Gloss is the same for ior and 1/ior. A `specular_color` c
// changes its reflectance F to F − (1 − c) f0 (1 − w), with Schlick's w = (1 − cos)⁵. Layers below get as much light as
// below white gloss.
//
// T and T' are the shares of light that a layer leaves to those below. They follow from the layer's directional albedo
// E, so that white layers reflect all light. f is reciprocal.
//
// A sheen of colour s (sheen.h) replaces m·metal + (1 − m)(1 − t)·plastic by
//   (1 − (1 − m) t)·s·sheen + T"·(m·metal + (1 − m)(1 − t)·plastic)
// T" is like T, with the largest component of s for c. E' of rough metal and gloss is between E_mean and E. Glass has
// no sheen. Surfaces have none as seen from within glass.
//
// Metal and gloss can be anisotropic. Then they are rougher along x. Coat, glass and sheen are isotropic.
//
// `burley` replaces T'·diffuse by that of Burley (Physically-Based Shading at Disney, 2012, 5.3), as in Blender
// before 4.0:
//   base/π · (1 + (r − ½)F(wo))(1 + (r − ½)F(wi)),  F(w) = (1 − cos)⁵,  r = roughness·(1 + wo·wi)
// The gloss takes no light from it. So gloss and a bright base can reflect more light than arrives.
//
// A sheet with the transmittance τ scatters this share of the diffuse part's light to its other side. It has (1 − τ) base
// for base, and below it adds, with the directional albedos of all layers in L(w) = Π(1 − E(w)) and M = Π(1 − E_mean):
//   τ/π · L(wo) L(wi)/M   of a thin sheet, which has its layers on both sides
//   τ/π · L(w)/√M         around a medium, where w is the direction outside
// Around a medium the inside is bare: it has no gloss, coat or sheen. So light that enters and leaves is scaled by
// L(wo) L(wi)/M, as that of the diffuse part is. A short way through the medium shows the medium's colour as base would.
// White sheets around white media lose no light, and f stays reciprocal. Cycles scales by L(w) where light enters, and
// by 1 where it leaves, which has the same albedo. Of Burley's diffuse part, (1 − F/2) replaces the 1 − E of the gloss,
// and 1 its mean. Light that it sends back at grazing angles has the base colour, as in Cycles.
//
// Metal and glass compensate for multiple scattering (ggx_albedo.h). The gloss does not: it leaves that light to the
// diffuse part.
#pragma once

#include <optional>

#include "common/materials/ggx_facets.h"
#include "common/materials/rough_dielectric.h"
#include "common/materials/sheen.h"

namespace lightmill {

/// Anisotropy of metal and gloss (ggx_facets.h).
struct PrincipledAnisotropy8 {
  F8 strength;  ///< in [0, 1]
  M8 directed;  ///< x is its direction; otherwise it has none
};

struct PrincipledSheen8 {
  V8 color;      ///< each in [0, 1]
  F8 roughness;  ///< in [0, 1]
};

/// Diffuse transmission.
struct PrincipledSheet8 {
  V8 transmittance;  ///< τ, each in [0, 1]
  M8 closed;         ///< around a medium
};

struct PrincipledParameters8 {
  V8 base_color;
  F8 metallic, roughness, specular, transmission;  ///< each in [0, 1]; roughness is √alpha; specular .5 is the value
                                                   ///< for `ior`
  F8 ior;                                          ///< of the inside
  F8 coat, coat_roughness;                         ///< each in [0, 1]
  M8 compensated;                                  ///< metal and glass, for multiple scattering
  M8 burley = M8();                                ///< Burley's diffuse part
  std::optional<PrincipledAnisotropy8> anisotropy = {};
  std::optional<PrincipledSheen8> sheen = {};
  std::optional<PrincipledSheet8> sheet = {};
  std::optional<V8> specular_color = {};  ///< of gloss at normal incidence, each in [0, 1]
};

/// Lobes with alpha below ggx::kSmoothAlpha are delta. They are sampled, but omitted by eval and pdf. A lobe is chosen
/// by its albedo.
class Principled8 {
 public:
  static constexpr bool kTransmits = true, kHasLobes = true, kLosesSamples = true;

  /// `front`: wo is on the side of the outward normal. `eta`: index of refraction behind the surface over that on wo's
  /// side.
  Principled8(const PrincipledParameters8& p, F8 eta, const V8& wo, M8 front);

  V8 eval(const V8& wo, const V8& wi) const;
  F8 pdf_solid_angle(const V8& wo, const V8& wi) const;
  BsdfSample8 sample(const V8& wo, Pair8 u, F8 choice) const;
  /// `f`: Fresnel term of the glass at wo, or a replacement.
  DeltaLobes8 smooth(const V8& wo, const dielectric::Fresnel8& f) const;
  /// Share of uniform light that the lobes which are not delta scatter to wo. Rough glass counts with its base colour.
  /// Layers below a coat count as diffuse.
  V8 rough_albedo() const;
  /// Lanes with glass, and sheets.
  M8 transmits() const;

 private:
  /// Share T of light that the coat leaves to the diffuse layer below, or to facets.
  F8 coat_leaves(const V8& wo, const V8& wi, bool diffuse) const;
  /// cE' of the facets. `albedo`: cE.
  F8 coat_below(F8 cos_theta, F8 albedo) const;
  /// Share T" of light from wi that the sheen leaves to the diffuse layer below, or to facets.
  F8 sheen_leaves(const V8& wi, bool diffuse) const;
  /// Of metal, plastic, and the coat as seen from within glass. `balance`: g(wo) g(wi) of ggx_albedo.h, or 1.
  V8 gloss_fresnel(F8 cos_o, F8 balance) const;
  /// `white`: reflectance or albedo of white gloss. `not_grazing`: 1 − w, or its albedo.
  V8 colored_gloss(F8 white, F8 not_grazing) const;
  /// Share of the light from within glass that the coat sends back.
  V8 inner_coat(F8 cos_o) const;
  F8 coat_fresnel(F8 cos_o) const;
  /// Share L of light to or from a direction outside that the layers leave to the sheet.
  F8 layers_leave(const V8& outside) const;
  /// Scale of the light that a sheet transmits from wi, over τ cos/π.
  F8 through_sheet(const V8& wi) const;
  /// Share of uniform light that a sheet of transmittance 1 transmits to wo.
  F8 sheet_albedo() const;
  void set_metal(const V8& wo);
  void set_sheet(const V8& wo);
  void set_probabilities(const V8& wo);

  struct Drawn8 {
    V8 wi;
    V8 smooth_weight;  ///< of a delta lobe
    M8 smooth;
    M8 valid;  ///< the lobe exists in this direction
    M8 through, refracted;
  };
  Drawn8 draw(const V8& wo, Pair8 u, F8 choice) const;

  V8 base_;
  ggx::Facets8 facets_;  ///< of metal and gloss
  F8 alpha_;             ///< their mean alpha
  F8 coat_alpha_;
  F8 metal_, plastic_, glass_;    ///< shares
  V8 metal_kept_;                 ///< κ of ggx_albedo.h
  V8 metal_albedo_;               ///< from wo
  F8 gloss_, gloss_eta_;          ///< weight and index of the plastic's gloss
  std::optional<V8> gloss_less_;  ///< (1 − specular_color) f0
  M8 compensated_;
  F8 coat_, coat_beyond_;                ///< on wo's side, and on the other side of glass
  F8 gloss_albedo_, gloss_albedo_mean_;  ///< of a white gloss: layers below get no light that its colour takes away
  V8 gloss_color_albedo_;                ///< from wo
  M8 burley_;
  F8 roughness_;
  F8 diffuse_albedo_;  ///< of the plastic's white diffuse part, from wo
  F8 coat_albedo_, coat_mean_;
  RoughDielectric8 glass_bsdf_;
  bool has_glass_, has_coat_, has_burley_;     ///< in any lane
  F8 p_diffuse_, p_gloss_, p_glass_, p_coat_;  ///< probabilities, whose sum is 1 where anything is reflected
  struct Layer8 {
    Sheen8 white;
    V8 color;         ///< times the share of the surface that has it
    F8 weight;        ///< the largest component of the colour
    F8 p = F8(0.0f);  ///< probability, part of the sum 1
  };
  std::optional<Layer8> sheen_;  ///< if there is one in any lane
  struct Sheet8 {
    V8 transmittance;
    M8 closed, inside;        ///< around a medium; wo is in the medium
    M8 burley;                ///< outside
    F8 gloss, coat, sheen;    ///< weights of the layers outside; of the sheen, the largest component
    F8 root_mean = F8(1.0f);  ///< √M
    F8 at_wo = F8(1.0f);      ///< L(wo), if wo is outside
    F8 lambert = F8(0.0f);    ///< like diffuse_albedo_, without retro-reflection
    F8 p = F8(0.0f);          ///< probability, part of the sum 1
  };
  std::optional<Sheet8> sheet_;  ///< if there is one in any lane
};

}  // namespace lightmill
