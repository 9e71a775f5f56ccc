// Warps from the unit square to directions and surfaces. Each has its density, in the measure that its name states.
#pragma once

#include "common/math/transcendental.h"
#include "common/math/vec.h"
#include "common/sampling/sobol.h"

namespace lightmill {

/// To the unit disk, area-preserving and continuous (Shirley and Chiu 1997).
inline Pair8 square_to_disk(Pair8 p) {
  const F8 a = p.u * F8(2.0f) - F8(1.0f);
  const F8 b = p.v * F8(2.0f) - F8(1.0f);
  const M8 a_larger = abs(b) < abs(a);
  const F8 radius = select(a_larger, a, b);
  const F8 other = select(a_larger, b, a);
  const F8 ratio = select(radius == F8(0.0f), F8(0.0f), other / radius);
  const SinCos8 r = sin_cos_quarter(ratio * F8(kPi / 4));
  return {radius * select(a_larger, r.cos, r.sin), radius * select(a_larger, r.sin, r.cos)};
}

/// To directions about +z with density cosθ/π per solid angle (Malley's method).
inline V8 square_to_cosine_hemisphere(Pair8 p) {
  const Pair8 d = square_to_disk(p);
  const F8 z2 = F8(1.0f) - d.u * d.u - d.v * d.v;
  return {d.u, d.v, sqrt(max(z2, F8(1e-12f)))};
}
inline F8 cosine_hemisphere_pdf_solid_angle(F8 cos_theta) {
  return max(cos_theta, F8(0.0f)) * F8(kInvPi);
}

/// To barycentric coordinates (of the second and third corner), uniform over a triangle (Heitz 2019, "A Low-Distortion
/// Map Between Triangle and Square").
inline Pair8 square_to_triangle(Pair8 p) {
  const M8 upper = p.v > p.u;
  const F8 x = p.u * F8(0.5f);
  const F8 y = p.v * F8(0.5f);
  return {select(upper, x, p.u - y), select(upper, p.v - x, y)};
}

/// To directions in a cone about +z, uniform per solid angle. `one_minus_cos` is 1 − cosθmax, in (0, 1].
inline V8 square_to_cone(Pair8 p, F8 one_minus_cos) {
  const F8 h = p.u * one_minus_cos;  // 1 − cosθ
  const F8 sin_theta = sqrt(max(h * (F8(2.0f) - h), F8(0.0f)));
  const SinCos8 phi = sin_cos_turns(p.v);
  return {sin_theta * phi.cos, sin_theta * phi.sin, F8(1.0f) - h};
}
inline F8 cone_pdf_solid_angle(F8 one_minus_cos) {
  return F8(1.0f) / (F8(2 * kPi) * one_minus_cos);
}

/// To the unit sphere, uniform with density 1/(4π) per solid angle.
inline V8 square_to_sphere(Pair8 p) {
  const F8 z = F8(1.0f) - p.u * F8(2.0f);
  const F8 r = sqrt(max(F8(1.0f) - z * z, F8(0.0f)));
  const SinCos8 phi = sin_cos_turns(p.v);
  return {r * phi.cos, r * phi.sin, z};
}

}  // namespace lightmill
