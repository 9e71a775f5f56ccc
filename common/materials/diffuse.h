// Lambertian BSDF: f = ρ/π.
#pragma once

#include "common/materials/bsdf.h"

namespace lightmill {

struct Diffuse8 {
  static constexpr bool kTransmits = false, kHasLobes = false, kLosesSamples = false;
  V8 reflectance;

  V8 eval(const V8& /*wo*/, const V8& wi) const { return reflectance * (max(wi.z, F8(0.0f)) * F8(kInvPi)); }
  F8 pdf_solid_angle(const V8& /*wo*/, const V8& wi) const { return cosine_hemisphere_pdf_solid_angle(wi.z); }
  BsdfSample8 sample(const V8& /*wo*/, Pair8 u, F8 /*choice*/) const {
    const V8 wi = square_to_cosine_hemisphere(u);
    return {wi, reflectance, cosine_hemisphere_pdf_solid_angle(wi.z), M8(), F8(1.0f)};
  }
};

}  // namespace lightmill
