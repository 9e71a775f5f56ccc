// Phase function of scattering media: Henyey and Greenstein 1941.
#pragma once

#include "common/math/transcendental.h"
#include "common/math/vec.h"
#include "common/sampling/warp.h"

namespace lightmill {

/// `g`: mean cosine in [-0.99, 0.99], positive for forward scattering. Single precision cannot resolve narrower peaks.
/// `wo` points back along the path. Value and density per solid angle are equal, so a sample's weight is 1.
struct HenyeyGreenstein8 {
  F8 g;

  F8 pdf_solid_angle(const V8& wo, const V8& wi) const {
    // 1 + g² − 2g cos θ = (1 − g)² + 2g (1 − cos θ) with |wi + wo|² = 2 (1 − cos θ) is accurate at the peak. For
    // negative g the peak is on the other side.
    const F8 size = abs(g);
    const V8 from_peak = wi + select(g < F8(0.0f), -wo, wo);
    const F8 d = (F8(1.0f) - size) * (F8(1.0f) - size) + size * length_squared(from_peak);
    return F8(kInvPi / 4) * (F8(1.0f) - size) * (F8(1.0f) + size) / (d * sqrt(d));
  }

  V8 sample(const V8& wo, Pair8 u) const {
    const F8 size = abs(g);
    // 1 − cos θ about the peak, without cancellation: with s = (1 − g²)/(1 + g − 2gu), cos θ = (1 + g² − s²)/(2g).
    const F8 denominator = F8(1.0f) + size - F8(2.0f) * size * u.u;
    const F8 away = F8(1.0f) - size;
    const F8 one_minus_cos =
        F8(2.0f) * u.u * (away * away) * (F8(1.0f) + size * (F8(1.0f) - u.u)) / (denominator * denominator);
    const F8 h = min(max(one_minus_cos, F8(0.0f)), F8(2.0f));
    const F8 sin_theta = sqrt(h * (F8(2.0f) - h));
    const SinCos8 phi = sin_cos_turns(u.v);
    const Frame8 about_peak(select(g < F8(0.0f), wo, -wo));
    return about_peak.to_world({sin_theta * phi.cos, sin_theta * phi.sin, F8(1.0f) - h});
  }
};

}  // namespace lightmill
