// Diffuse BSDF of thin sheets, such as leaves, paper and cloth: f = ρ/π on the side of wo, and τ/π on the other side.
#pragma once

#include "common/materials/bsdf.h"

namespace lightmill {

struct DiffuseTransmission8 {
  static constexpr bool kTransmits = true, kHasLobes = true, kLosesSamples = false;
  V8 reflectance, transmittance;  ///< ρ and τ. Their sum is at most 1

  V8 eval(const V8& /*wo*/, const V8& wi) const {
    return select(wi.z < F8(0.0f), transmittance, reflectance) * (abs(wi.z) * F8(kInvPi));
  }
  F8 pdf_solid_angle(const V8& /*wo*/, const V8& wi) const {
    const F8 share = transmitted_share();
    return select(wi.z < F8(0.0f), share, F8(1.0f) - share) * cosine_hemisphere_pdf_solid_angle(abs(wi.z));
  }
  BsdfSample8 sample(const V8& /*wo*/, Pair8 u, F8 choice) const {
    const F8 share = transmitted_share();
    const M8 through = choice < share;
    V8 wi = square_to_cosine_hemisphere(u);
    const F8 probability = select(through, share, F8(1.0f) - share);
    const F8 pdf = probability * cosine_hemisphere_pdf_solid_angle(wi.z);
    wi.z = select(through, -wi.z, wi.z);
    return {wi, select(through, transmittance, reflectance) * (F8(1.0f) / probability), pdf, through, F8(1.0f)};
  }

 private:
  /// Probability of the other side.
  F8 transmitted_share() const {
    const F8 r = max_component(reflectance), t = max_component(transmittance);
    return masked(t > F8(0.0f), t / (r + t));
  }
};

}  // namespace lightmill
