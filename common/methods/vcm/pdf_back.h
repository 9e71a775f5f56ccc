// With which density a scattered path would have been scattered the other way.
#pragma once

#include "common/methods/surface_bsdf.h"

namespace lightmill::vcm {

inline V8 flipped(M8 lanes, const V8& v) {
  return {v.x, v.y, select(lanes, -v.z, v.z)};
}

/// Of drawing `wo` where `wi` is given, both as the BSDF of this surface has them for a ray from `wo`; per solid angle.
/// What the surface is from `wi`'s side is found anew where light passes through.
template <class Bsdf>
F8 pdf_back(const CompiledScene& scene, const Surface8& surface, const Crossing8& crossing, const Bsdf& bsdf,
            const V8& wo, const V8& wi, M8 lanes) {
  if constexpr (!Bsdf::kTransmits) {
    return masked(wi.z > F8(0.0f), bsdf.pdf_solid_angle(wi, wo));
  } else {
    const M8 through = wi.z < F8(0.0f);
    const F8 ahead = relative_index(scene, surface, crossing, lanes);
    const F8 eta = select(through, F8(1.0f) / ahead, ahead);
    const V8 from = flipped(through, wi), to = flipped(through, wo);
    if constexpr (std::is_same_v<Bsdf, RoughDielectric8>) {
      return RoughDielectric8{eta, bsdf.alpha}.pdf_solid_angle(from, to);
    } else {
      static_assert(std::is_same_v<Bsdf, Principled8>);
      const M8 front = and_not(surface.front, through) | and_not(through, surface.front);
      return Principled8(scene.materials().principled(surface, lanes), eta, from, front).pdf_solid_angle(from, to);
    }
  }
}

}  // namespace lightmill::vcm
