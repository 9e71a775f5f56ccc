// Sheen BSDF: light that the fibres of cloth reflect, mostly at grazing angles, as in KHR_materials_sheen. Estevez and
// Kulla 2017, "Production Friendly Microfacet Sheen BRDF", with alpha = roughness².
//
// Below a roughness of 0.27 this reflects up to twice the light that arrives at a grazing angle. So it is multiplied by
// k(wo) k(wi), where k is 1 over its albedo, at most 1. The layers below get the rest of the light. A step of the build
// tabulates k and the albedo after it (sheen_tabulate.cpp).
#pragma once

#include "common/math/exp_log.h"
#include "common/math/vec.h"
#include "common/sampling/warp.h"

namespace lightmill::sheen {

/// Smaller roughnesses count as this one.
inline constexpr float kMinRoughness = 0.1f;

/// Density of fibres' normals m, per solid angle and projected area. `sin2`: of the angle to the surface's normal.
inline F8 distribution(F8 sin2, F8 alpha) {
  const F8 exponent = F8(1.0f) / alpha;
  return (F8(2.0f) + exponent) * pow(max(sin2, F8(1e-30f)), F8(0.5f) * exponent) * F8(kInvPi / 2);
}

/// Smith's Λ, for cosines in (0, 1].
inline F8 lambda(F8 cosine, F8 alpha) {
  const F8 t = (F8(1.0f) - alpha) * (F8(1.0f) - alpha);
  const auto mix = [&](float rough, float smooth) { return F8(rough) + F8(smooth - rough) * t; };
  const F8 a = mix(21.5473f, 25.3245f), b = mix(3.82987f, 3.32435f), c = mix(0.19823f, 0.16801f);
  const F8 d = mix(-1.97760f, -1.27393f), e = mix(-4.32054f, -4.85967f);
  const auto fit = [&](F8 x) { return a / (F8(1.0f) + b * pow(x, c)) + d * x + e; };
  const M8 low = cosine < F8(0.5f);
  const F8 near = fit(max(select(low, cosine, F8(1.0f) - cosine), F8(1e-7f)));
  return exp(select(low, near, F8(2.0f) * fit(F8(0.5f)) - near));
}

/// BRDF · cos θi without k, for directions above the surface.
inline F8 unlimited(const V8& wo, const V8& wi, F8 alpha, F8 lambda_o) {
  const V8 sum = wo + wi;
  const F8 sin2 = (sum.x * sum.x + sum.y * sum.y) / length_squared(sum);
  return distribution(sin2, alpha) / ((F8(1.0f) + lambda_o + lambda(wi.z, alpha)) * F8(4.0f) * wo.z);
}

/// k, in (0, 1].
F8 limit(F8 cos_theta, F8 roughness);
/// At most 0.9999, because 1 − albedo is a divisor.
F8 albedo(F8 cos_theta, F8 roughness);
/// Mean of `albedo` over the hemisphere, weighted by cos θ.
F8 mean_albedo(F8 roughness);

}  // namespace lightmill::sheen

namespace lightmill {

/// White sheen seen from one direction. It is reciprocal, and has no delta lobe.
class Sheen8 {
 public:
  Sheen8(F8 roughness, const V8& wo)
      : roughness_(max(roughness, F8(sheen::kMinRoughness))),
        lambda_(sheen::lambda(wo.z, alpha())),
        limit_(sheen::limit(wo.z, roughness_)),
        albedo_(sheen::albedo(wo.z, roughness_)) {}

  /// BRDF · cos θi. 0 below the surface.
  F8 reflection(const V8& wo, const V8& wi) const {
    const F8 light = sheen::unlimited(wo, {wi.x, wi.y, max(wi.z, F8(1e-7f))}, alpha(), lambda_);
    return masked(wi.z > F8(0.0f), light * limit_ * sheen::limit(wi.z, roughness_));
  }
  /// Uniform directions: the lobe is wide.
  static V8 sample(Pair8 u) { return square_to_cone(u, F8(1.0f)); }
  static F8 pdf_solid_angle(F8 cos_i) { return masked(cos_i > F8(0.0f), F8(kInvPi / 2)); }

  F8 albedo() const { return albedo_; }
  F8 albedo(F8 cosine) const { return sheen::albedo(cosine, roughness_); }
  F8 mean_albedo() const { return sheen::mean_albedo(roughness_); }

 private:
  F8 alpha() const { return roughness_ * roughness_; }

  F8 roughness_;
  F8 lambda_, limit_, albedo_;  ///< of wo
};

}  // namespace lightmill
