// Smooth dielectric BSDF: reflection and refraction by Fresnel's equations for unpolarised light.
#pragma once

#include "common/materials/bsdf.h"

namespace lightmill::dielectric {

struct Fresnel8 {
  F8 reflectance;    ///< 1 at total internal reflection
  F8 cos_refracted;  ///< 0 at total internal reflection
};

/// `eta`: index of refraction behind the surface over that on this side. cos_i is in (0, 1].
inline Fresnel8 fresnel(F8 cos_i, F8 eta) {
  const F8 sin2_t = (F8(1.0f) - cos_i * cos_i) / (eta * eta);
  const M8 total = sin2_t >= F8(1.0f);
  const F8 cos_t = sqrt(max(F8(1.0f) - sin2_t, F8(0.0f)));
  const F8 s = (cos_i - eta * cos_t) / (cos_i + eta * cos_t);
  const F8 p = (eta * cos_i - cos_t) / (eta * cos_i + cos_t);
  return {select(total, F8(1.0f), (s * s + p * p) * F8(0.5f)), masked(~total, cos_t)};
}

}  // namespace lightmill::dielectric

namespace lightmill {

struct Dielectric8 {
  F8 eta;  ///< index of refraction behind the surface over that on wo's side

  /// Chooses reflection with the Fresnel reflectance by `u`, else refraction. The weight is that of radiance: 1 for
  /// reflection, 1/eta² for refraction (radiance is compressed in denser media).
  BsdfSample8 sample(const V8& wo, F8 u) const {
    const dielectric::Fresnel8 f = dielectric::fresnel(wo.z, eta);
    const M8 refracted = u >= f.reflectance;
    const F8 inverse_eta = F8(1.0f) / eta;
    const V8 through{-(wo.x * inverse_eta), -(wo.y * inverse_eta), -f.cos_refracted};
    const F8 weight = select(refracted, inverse_eta * inverse_eta, F8(1.0f));
    return {select(refracted, through, V8{-wo.x, -wo.y, wo.z}),
            {weight, weight, weight},
            F8(0.0f),
            refracted,
            select(refracted, eta, F8(1.0f))};
  }
};

}  // namespace lightmill
