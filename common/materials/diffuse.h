// Lambert: f = ρ/π.
#pragma once

#include "common/materials/bsdf.h"

namespace lightmill::diffuse {

inline V8 eval(const V8& reflectance, const V8& wi) {
  return reflectance * (max(wi.z, F8(0.0f)) * F8(kInvPi));
}

inline F8 pdf_solid_angle(const V8& wi) {
  return cosine_hemisphere_pdf_solid_angle(wi.z);
}

inline BsdfSample8 sample(const V8& reflectance, Pair8 u) {
  const V8 wi = square_to_cosine_hemisphere(u);
  return {wi, reflectance, cosine_hemisphere_pdf_solid_angle(wi.z)};
}

}  // namespace lightmill::diffuse
