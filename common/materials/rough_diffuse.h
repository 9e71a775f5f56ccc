// Rough diffuse BSDF: Oren-Nayar in Fujii's form, with the light that meets several facets (EON).
//
// Portsmouth, Kutz and Hill 2025, "EON: A Practical Energy-Preserving Rough Diffuse BRDF". With roughness r in [0, 1],
//   f = (ρ/π) A (1 + r s/t) + multiple scattering,   A = 1 / (1 + (1/2 − 2/3π) r),
// where s = ωo·ωi − cos θo cos θi, and t = max(cos θo, cos θi) for positive s, else 1. The directional albedo of the
// first part is A (1 + r g(cos θ)) for ρ = 1. What is missing from 1 is scattered again, and ρ is applied each time.
#pragma once

#include "common/materials/bsdf.h"

namespace lightmill {

namespace rough_diffuse {

/// 1/2 − 2/3π. So A = 1 / (1 + kLoss r).
inline constexpr float kLoss = 0.28779341f;
/// Mean of gap() over the hemisphere, weighted by the cosine.
inline constexpr float kMeanGap = 0.21523219f;

/// kLoss − g: the albedo that is missing from 1, over A r. The paper's fit of g has an error below 0.0005.
inline F8 gap(F8 cos_theta) {
  const F8 m = F8(1.0f) - cos_theta;
  const F8 g = m * (F8(0.0571085289f) + m * (F8(0.491881867f) + m * (F8(-0.332181442f) + m * F8(0.0714429953f))));
  return max(F8(kLoss) - g, F8(0.0f));
}

}  // namespace rough_diffuse

/// It is reciprocal. With `compensated` and a reflectance of 1 it reflects all light.
struct RoughDiffuse8 {
  static constexpr bool kTransmits = false, kHasLobes = true, kLosesSamples = false;
  V8 reflectance;
  F8 roughness;    ///< in [0, 1]; 0: Lambert
  M8 compensated;  ///< with multiple scattering. Without, very rough surfaces lose 17 % of the light on average

  /// Share of uniform light that is reflected.
  V8 mean_albedo() const {
    const F8 missing = missing_share(), once = F8(1.0f) - missing;
    const auto of = [&](F8 rho) { return rho * once / (F8(1.0f) - select(compensated, rho * missing, F8(0.0f))); };
    return {of(reflectance.x), of(reflectance.y), of(reflectance.z)};
  }
  V8 eval(const V8& wo, const V8& wi) const {
    const F8 cos_i = max(wi.z, F8(0.0f)), a = scale();
    const F8 s = wo.x * wi.x + wo.y * wi.y;
    const F8 t = select(s > F8(0.0f), max(max(wo.z, cos_i), F8(1e-20f)), F8(1.0f));
    const V8 once = reflectance * (a * (F8(1.0f) + roughness * (s / t)));
    return (once + masked(compensated, again(wo.z, cos_i))) * (cos_i * F8(kInvPi));
  }
  F8 pdf_solid_angle(const V8& wo, const V8& wi) const {
    const F8 uniform = uniform_share(wo);
    const F8 pdf = (F8(1.0f) - uniform) * cosine_hemisphere_pdf_solid_angle(wi.z) + uniform * F8(kInvPi / 2);
    return masked(wi.z > F8(0.0f), pdf);
  }
  BsdfSample8 sample(const V8& wo, Pair8 u, F8 choice) const {
    const V8 wi = select(choice < uniform_share(wo), square_to_cone(u, F8(1.0f)), square_to_cosine_hemisphere(u));
    const F8 pdf = max(pdf_solid_angle(wo, wi), F8(1e-20f));
    return {wi, eval(wo, wi) * (F8(1.0f) / pdf), pdf, M8(), F8(1.0f)};
  }

 private:
  F8 scale() const { return F8(1.0f) / (F8(1.0f) + F8(rough_diffuse::kLoss) * roughness); }
  /// Share of uniform light that a white surface reflects only after several facets.
  F8 missing_share() const { return F8(rough_diffuse::kMeanGap) * roughness * scale(); }
  /// π times the BRDF of light that meets several facets.
  V8 again(F8 cos_o, F8 cos_i) const {
    const F8 missing = missing_share();
    const F8 shape = rough_diffuse::gap(cos_o) * rough_diffuse::gap(cos_i) *
                     (roughness * scale() * F8(1.0f / rough_diffuse::kMeanGap));
    const auto of = [&](F8 rho) { return rho * rho * ((F8(1.0f) - missing) * shape) / (F8(1.0f) - rho * missing); };
    return {of(reflectance.x), of(reflectance.y), of(reflectance.z)};
  }
  /// Probability of a uniform direction. At grazing angles the lobe towards wo is brighter than a cosine.
  F8 uniform_share(const V8& wo) const {
    const F8 x = roughness * (F8(1.0f) - wo.z);
    return x / (F8(1.0f) + x);
  }
};

}  // namespace lightmill
