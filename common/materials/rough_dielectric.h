// Rough dielectric BSDF: GGX facets that reflect and refract by Fresnel's equations.
//
// Walter et al. 2007, eqs. 16, 17, 20 and 21. Refraction carries radiance (1/eta²), so it is reciprocal up to eta²:
// f(wo, wi) = f(wi, wo)/eta², where the second is seen from the other side. Compensation of multiple scattering keeps
// this (ggx_albedo.h).
#pragma once

#include "common/materials/dielectric.h"
#include "common/materials/ggx.h"
#include "common/materials/ggx_albedo.h"

namespace lightmill {

/// Lanes with too narrow lobes are delta: alpha < ggx::kSmoothAlpha, or alpha · |eta − 1| < 1e-5.
struct RoughDielectric8 {
  static constexpr bool kTransmits = true, kHasLobes = true, kLosesSamples = true;
  F8 eta;                                    ///< index of refraction behind the surface over that on wo's side
  F8 alpha;                                  ///< GGX, in [0, 1]
  V8 tint = {F8(1.0f), F8(1.0f), F8(1.0f)};  ///< of refracted light
  M8 compensated = M8();                     ///< for multiple scattering

  M8 rough() const { return (alpha >= F8(ggx::kSmoothAlpha)) & (alpha * abs(eta - F8(1.0f)) >= F8(1e-5f)); }

  V8 eval(const V8& wo, const V8& wi) const {
    const M8 through = wi.z < F8(0.0f);
    const Facet8 facet = facet_of(wo, wi, through);
    const F8 reflected = ggx::reflection(wo, wi, facet.m, alpha) * facet.fresnel;
    const F8 refracted = ggx::distribution(facet.m, alpha) * ggx::masking_over_cos(wo, alpha) *
                         (ggx::masking_over_cos(wi, alpha) * abs(wi.z)) * facet.jacobian * facet.cos_o *
                         (F8(1.0f) - facet.fresnel) / (eta * eta);
    const V8 white = broadcast(Vec3(1));
    const F8 light = select(through, refracted, reflected) * all_bounces(wo, wi, through);
    return masked(facet.valid, select(through, tint, white) * light);
  }

  F8 pdf_solid_angle(const V8& wo, const V8& wi) const {
    const M8 through = wi.z < F8(0.0f);
    const Facet8 facet = facet_of(wo, wi, through);
    const F8 reflected = ggx::reflection_pdf_solid_angle(wo, wi, facet.m, alpha) * facet.fresnel;
    const F8 refracted = ggx::visible_normal_pdf(wo, facet.m, alpha) * facet.jacobian * (F8(1.0f) - facet.fresnel);
    return masked(facet.valid, select(through, refracted, reflected));
  }

  /// Chooses reflection with the facet's Fresnel reflectance by `choice`, else refraction.
  BsdfSample8 sample(const V8& wo, Pair8 u, F8 choice) const {
    const M8 is_rough = rough();
    const V8 up{F8(0.0f), F8(0.0f), F8(1.0f)};
    const V8 m = select(is_rough, ggx::sample_visible_normal(wo, alpha, u), up);
    const F8 cos_o = min(dot(wo, m), F8(1.0f));
    const dielectric::Fresnel8 f = dielectric::fresnel(cos_o, eta);
    const M8 through = choice >= f.reflectance;
    const F8 inverse_eta = F8(1.0f) / eta;
    const V8 refracted = m * (cos_o * inverse_eta - f.cos_refracted) - wo * inverse_eta;
    const V8 wi = select(through, refracted, ggx::reflect(wo, m));
    // Samples on the wrong side are lost, because they would hit the surface again.
    const M8 valid = (through & (wi.z < F8(0.0f))) | and_not(wi.z > F8(0.0f), through);
    const F8 masking =
        select(through, ggx::masking_over_cos(wi, alpha) * abs(wi.z), ggx::reflection_weight(wo, wi, alpha));
    const F8 weight = select(is_rough, masking * all_bounces(wo, wi, through), F8(1.0f)) *
                      select(through, inverse_eta * inverse_eta, F8(1.0f));
    const V8 color = select(through, tint, broadcast(Vec3(1)));
    return {wi, masked(valid, color * weight), masked(is_rough, pdf_solid_angle(wo, wi)), through,
            select(through, eta, F8(1.0f))};
  }

  /// `f`: Fresnel term at wo, or a replacement.
  DeltaLobes8 smooth(const dielectric::Fresnel8& f) const {
    const F8 inverse_eta = F8(1.0f) / eta;
    const F8 refracted = (F8(1.0f) - f.reflectance) * (inverse_eta * inverse_eta);
    return {masked(~rough(), V8{f.reflectance, f.reflectance, f.reflectance}), masked(~rough(), tint * refracted)};
  }

 private:
  /// Ratio of the light of all bounces to the light of the first.
  F8 all_bounces(const V8& wo, const V8& wi, M8 through) const {
    if (compensated.none()) {
      return F8(1.0f);
    }
    const F8 eta_i = select(through, F8(1.0f) / eta, eta);
    const F8 balance = ggx::balance(wo.z, alpha, eta) * ggx::balance(abs(wi.z), alpha, eta_i);
    return select(compensated, balance, F8(1.0f));
  }

  struct Facet8 {
    V8 m;
    F8 cos_o;     ///< wo·m
    F8 fresnel;   ///< reflectance
    F8 jacobian;  ///< of refraction: solid angle of m over that of wi (eq. 17)
    M8 valid;
  };

  /// The facet that takes wo to wi.
  Facet8 facet_of(const V8& wo, const V8& wi, M8 through) const {
    const V8 sum = wo + wi * select(through, eta, F8(1.0f));
    V8 m = normalize(sum);
    m = select(m.z < F8(0.0f), -m, m);
    const F8 cos_o = dot(wo, m);
    const F8 cos_i = dot(wi, m);
    const F8 denominator = cos_o + eta * cos_i;
    const F8 jacobian = eta * eta * abs(cos_i) / (denominator * denominator);
    const F8 fresnel = dielectric::fresnel(min(max(cos_o, F8(0.0f)), F8(1.0f)), eta).reflectance;
    const M8 sides = (cos_o > F8(0.0f)) & ((through & (cos_i < F8(0.0f))) | and_not(cos_i > F8(0.0f), through));
    return {m, cos_o, fresnel, jacobian, sides & rough()};
  }
};

}  // namespace lightmill
