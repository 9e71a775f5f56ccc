// Metal BSDF: Fresnel reflection by a complex index of refraction per channel, smooth or rough (GGX).
//
// Rough metal compensates for multiple scattering (ggx_albedo.h). It is reciprocal.
#pragma once

#include "common/materials/ggx_facets.h"

namespace lightmill::conductor {

/// Fresnel reflectance for unpolarised light from a medium of index 1 to one of index n + ik. Born and Wolf,
/// "Principles of Optics", 14.2, solved for intensities.
inline F8 fresnel(F8 cos_i, F8 n, F8 k) {
  const F8 cos2 = cos_i * cos_i;
  const F8 sin2 = F8(1.0f) - cos2;
  const F8 difference = n * n - k * k - sin2;                                   // a² − b²
  const F8 product = n * k;                                                     // a b
  const F8 sum = sqrt(difference * difference + F8(4.0f) * product * product);  // a² + b²
  const F8 a2 = max((sum + difference) * F8(0.5f), F8(0.0f));
  const F8 twice_a_cos = F8(2.0f) * sqrt(a2) * cos_i;
  const F8 s = (sum + cos2 - twice_a_cos) / (sum + cos2 + twice_a_cos);
  const F8 even = cos2 * sum + sin2 * sin2;
  const F8 odd = twice_a_cos * sin2;
  const F8 p = s * ((even - odd) / (even + odd));
  return min(max((s + p) * F8(0.5f), F8(0.0f)), F8(1.0f));
}

inline V8 fresnel(F8 cos_i, const V8& n, const V8& k) {
  return {fresnel(cos_i, n.x, k.x), fresnel(cos_i, n.y, k.y), fresnel(cos_i, n.z, k.z)};
}

/// Reflectance at normal incidence.
template <class Number>
Number normal_reflectance(Number n, Number k) {
  return ((n - 1) * (n - 1) + k * k) / ((n + 1) * (n + 1) + k * k);
}

/// Mean reflectance of all directions, weighted by the cosine. Error below 1e-3.
Vec3 mean_fresnel(const Vec3& n, const Vec3& k);

}  // namespace lightmill::conductor

namespace lightmill {

/// Lanes whose facets are not rough are delta.
struct Conductor8 {
  static constexpr bool kTransmits = false, kHasLobes = false, kLosesSamples = true;
  V8 eta, k;  ///< complex index per channel, relative to the medium on wo's side
  ggx::Facets8 facets;
  V8 mean_fresnel = {};  ///< conductor::mean_fresnel; 0: single scattering only

  V8 eval(const V8& wo, const V8& wi) const {
    const V8 m = ggx::half_vector(wo, wi);
    const F8 reflected =
        masked(rough(), facets.with_axes([&](const ggx::Alpha8& alpha) { return ggx::reflection(wo, wi, m, alpha); }));
    return conductor::fresnel(max(dot(wo, m), F8(0.0f)), eta, k) * all_bounces(wo, wi) * reflected;
  }

  F8 pdf_solid_angle(const V8& wo, const V8& wi) const {
    return masked(rough(), facets.with_axes([&](const ggx::Alpha8& alpha) {
      return ggx::reflection_pdf_solid_angle(wo, wi, ggx::half_vector(wo, wi), alpha);
    }));
  }

  BsdfSample8 sample(const V8& wo, Pair8 u, F8 /*choice*/) const {
    return facets.with_axes([&](const ggx::Alpha8& alpha) { return sample(wo, u, alpha); });
  }

  DeltaLobes8 smooth(const V8& wo) const {
    return {masked(~rough(), conductor::fresnel(min(wo.z, F8(1.0f)), eta, k)), V8()};
  }

  M8 rough() const { return facets.rough(); }

 private:
  BsdfSample8 sample(const V8& wo, Pair8 u, const ggx::Alpha8& alpha) const {
    const M8 is_rough = rough();
    const V8 up{F8(0.0f), F8(0.0f), F8(1.0f)};
    const V8 m = select(is_rough, ggx::sample_visible_normal(wo, alpha, u), up);
    const V8 wi = ggx::reflect(wo, m);
    const V8 one = broadcast(Vec3(1));
    const V8 weight = select(is_rough, all_bounces(wo, wi) * ggx::reflection_weight(wo, wi, alpha), one);
    const V8 f = conductor::fresnel(min(dot(wo, m), F8(1.0f)), eta, k);
    return {wi, f * weight, masked(is_rough, ggx::reflection_pdf_solid_angle(wo, wi, m, alpha)), M8(), F8(1.0f)};
  }

  /// Ratio of the light of all bounces to the light of the first.
  V8 all_bounces(const V8& wo, const V8& wi) const {
    const V8 one = broadcast(Vec3(1));
    if ((max_component(mean_fresnel) > F8(0.0f)).none()) {
      return one;
    }
    const F8 gained = facets.balance(wo) * facets.balance(wi) - F8(1.0f);
    return one + ggx::kept_by_bounces(mean_fresnel, facets.mean_albedo()) * gained;
  }
};

}  // namespace lightmill
