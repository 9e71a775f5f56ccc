// Energy-conserving Phong BSDF: f = ρd/π + ρs (s + 2)/(2π) cosˢα, with α from the mirror direction and ρd + ρs <= 1.
#pragma once

#include "common/materials/bsdf.h"
#include "common/math/exp_log.h"

namespace lightmill {

/// A lobe is chosen by its albedo. The pdf is 0 below the surface. A direction drawn there has weight 0.
struct Phong8 {
  static constexpr bool kTransmits = false, kHasLobes = true, kLosesSamples = true;
  V8 diffuse, specular;  ///< albedos; their sum is at most 1 in each channel
  F8 exponent;           ///< s, in [0, 1e6]

  V8 eval(const V8& wo, const V8& wi) const {
    const F8 lobe = (exponent + F8(2.0f)) * F8(0.5f * kInvPi) * lobe_power(wo, wi);
    return masked(wi.z > F8(0.0f), diffuse * (wi.z * F8(kInvPi)) + specular * (lobe * wi.z));
  }

  F8 pdf_solid_angle(const V8& wo, const V8& wi) const {
    const F8 p = diffuse_probability();
    const F8 lobe = (exponent + F8(1.0f)) * F8(0.5f * kInvPi) * lobe_power(wo, wi);
    return masked(wi.z > F8(0.0f), p * (wi.z * F8(kInvPi)) + (F8(1.0f) - p) * lobe);
  }

  BsdfSample8 sample(const V8& wo, Pair8 u, F8 choice) const {
    const M8 about_normal = choice < diffuse_probability();
    const V8 wi = select(about_normal, square_to_cosine_hemisphere(u), sample_lobe(wo, u));
    const F8 pdf = pdf_solid_angle(wo, wi);
    return {wi, masked(pdf > F8(0.0f), eval(wo, wi) * (F8(1.0f) / pdf)), pdf, M8(), F8(1.0f)};
  }

 private:
  F8 diffuse_probability() const {
    const F8 d = diffuse.x + diffuse.y + diffuse.z;
    const F8 s = specular.x + specular.y + specular.z;
    return masked(d > F8(0.0f), d / (d + s));
  }

  /// cosˢα by 1 − cos α = |wi − r|²/2, which is accurate for sharp lobes.
  F8 lobe_power(const V8& wo, const V8& wi) const {
    const F8 one_minus_cos = length_squared(wi - V8{-wo.x, -wo.y, wo.z}) * F8(0.5f);
    return masked(one_minus_cos < F8(1.0f), pow_one_minus(min(one_minus_cos, F8(1.0f)), exponent));
  }

  /// cos α = u^(1/(s + 1)) about the mirror direction.
  V8 sample_lobe(const V8& wo, Pair8 u) const {
    const F8 one_minus_cos = -expm1(log(F8(1.0f) - u.u) / (exponent + F8(1.0f)));
    const F8 sin_alpha = sqrt(max(one_minus_cos * (F8(2.0f) - one_minus_cos), F8(0.0f)));
    const SinCos8 phi = sin_cos_turns(u.v);
    const Frame8 about({-wo.x, -wo.y, wo.z});
    return about.to_world({sin_alpha * phi.cos, sin_alpha * phi.sin, F8(1.0f) - one_minus_cos});
  }
};

}  // namespace lightmill
