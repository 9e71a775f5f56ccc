// GGX distribution of microfacet normals, with Smith's masking and visible normals.
//
// Walter et al. 2007, "Microfacet Models for Refraction through Rough Surfaces"; Heitz 2014, "Understanding the
// Masking-Shadowing Function", also for anisotropic surfaces. Sampling by spherical caps: Dupuy and Benyoub 2023,
// "Sampling Visible GGX Normals with Spherical Caps". Roughness, which users set, is √alpha.
#pragma once

#include "common/materials/bsdf.h"

namespace lightmill::ggx {

/// Surfaces with a smaller alpha count as smooth. Their lobe is about as narrow as rounding errors of directions, so it
/// cannot be evaluated.
inline constexpr float kSmoothAlpha = 1e-4f;

/// GGX's alpha along the x axis and along the y axis. The bits of a lane in which both are equal do not depend on the
/// other lanes.
struct Alpha8 {
  F8 x, y;
  F8 stretch, inverse_stretch;  ///< x/y and y/x
  bool isotropic;               ///< in all lanes

  Alpha8(F8 alpha) : x(alpha), y(alpha), stretch(1.0f), inverse_stretch(1.0f), isotropic(true) {}
  Alpha8(F8 along_x, F8 along_y)
      : x(along_x),
        y(along_y),
        stretch(select(x == y, F8(1.0f), x / y)),
        inverse_stretch(select(x == y, F8(1.0f), y / x)),
        isotropic((~(x == y)).none()) {}
};

/// Density of microfacets with normal m, per solid angle and projected area.
inline F8 distribution(const V8& m, const Alpha8& alpha) {
  const F8 alpha2 = alpha.x * alpha.y;
  F8 x2 = m.x * m.x, y2 = m.y * m.y;
  if (!alpha.isotropic) {
    x2 = x2 * alpha.inverse_stretch;
    y2 = y2 * alpha.stretch;
  }
  const F8 t = x2 + y2 + alpha2 * (m.z * m.z);
  return masked(m.z > F8(0.0f), alpha2 / (F8(kPi) * t * t));
}

/// |cos θ| · (1 + 2Λ) of a direction, from which Smith's functions follow without a division by cos θ.
inline F8 smith_root(const V8& w, const Alpha8& alpha) {
  F8 x2 = w.x * w.x, y2 = w.y * w.y;
  if (!alpha.isotropic) {
    x2 = x2 * alpha.stretch;
    y2 = y2 * alpha.inverse_stretch;
  }
  return sqrt(w.z * w.z + alpha.x * alpha.y * (x2 + y2));
}

/// G1(w)/|cos θ|.
inline F8 masking_over_cos(const V8& w, const Alpha8& alpha) {
  return F8(2.0f) / (abs(w.z) + smith_root(w, alpha));
}

/// Height-correlated masking and shadowing over 4 |cos θo| |cos θi|, for directions on one side.
inline F8 visibility(const V8& wo, const V8& wi, const Alpha8& alpha) {
  return F8(0.5f) / (abs(wo.z) * smith_root(wi, alpha) + abs(wi.z) * smith_root(wo, alpha));
}

/// Samples normals visible from wo, with density D G1(wo) (wo·m)/wo.z.
inline V8 sample_visible_normal(const V8& wo, const Alpha8& alpha, Pair8 u) {
  const V8 stretched = normalize({alpha.x * wo.x, alpha.y * wo.y, wo.z});
  // A uniform point of the spherical cap of reflected directions.
  const F8 height = (F8(1.0f) - u.v) * (F8(1.0f) + stretched.z);  // of the cap's point above -stretched.z
  const F8 z = height - stretched.z;
  const F8 r = sqrt(max(F8(1.0f) - z * z, F8(0.0f)));
  const SinCos8 phi = sin_cos_turns(u.u);
  const V8 half{r * phi.cos + stretched.x, r * phi.sin + stretched.y, height};
  return normalize({alpha.x * half.x, alpha.y * half.y, half.z});
}

inline F8 visible_normal_pdf(const V8& wo, const V8& m, const Alpha8& alpha) {
  return distribution(m, alpha) * masking_over_cos(wo, alpha) * max(dot(wo, m), F8(0.0f));
}

inline V8 reflect(const V8& wo, const V8& m) {
  return m * (F8(2.0f) * dot(wo, m)) - wo;
}

/// The half vector of two directions on wo's side.
inline V8 half_vector(const V8& wo, const V8& wi) {
  return normalize(wo + wi);
}

/// BRDF · cos θi without the Fresnel factor.
inline F8 reflection(const V8& wo, const V8& wi, const V8& m, const Alpha8& alpha) {
  return masked(wi.z > F8(0.0f), distribution(m, alpha) * visibility(wo, wi, alpha) * wi.z);
}

/// Density of wi = reflect(wo, m) for a visible normal m. 0 below the surface, where wi has weight 0.
inline F8 reflection_pdf_solid_angle(const V8& wo, const V8& wi, const V8& m, const Alpha8& alpha) {
  return masked(wi.z > F8(0.0f), distribution(m, alpha) * masking_over_cos(wo, alpha) * F8(0.25f));
}

/// reflection / reflection_pdf_solid_angle: G2/G1(wo).
inline F8 reflection_weight(const V8& wo, const V8& wi, const Alpha8& alpha) {
  const F8 root_o = smith_root(wo, alpha);
  const F8 weight = wi.z * (wo.z + root_o) / (wo.z * smith_root(wi, alpha) + wi.z * root_o);
  return masked(wi.z > F8(0.0f), weight);
}

}  // namespace lightmill::ggx
