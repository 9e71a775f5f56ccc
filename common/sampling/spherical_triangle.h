// Spherical triangles: solid angle, and sampling uniform per solid angle.
#pragma once

#include "common/math/transcendental.h"
#include "common/math/vec.h"
#include "common/sampling/sobol.h"

namespace lightmill {

/// Solid angle of the triangle between three unit directions, in [0, 2π] (Van Oosterom and Strackee 1983, eq. 8). It
/// keeps its relative accuracy for small triangles.
inline F8 triangle_solid_angle(const V8& a, const V8& b, const V8& c) {
  const F8 volume = abs(dot(a, cross(b, c)));
  return F8(2.0f) * atan2(volume, F8(1.0f) + dot(a, b) + dot(b, c) + dot(c, a));
}

/// A direction in the triangle between three unit directions, uniform per solid angle (Arvo 1995, "Stratified Sampling
/// of Spherical Triangles"). `solid_angle`: the triangle's, in [1e-3, 6.2]. Outside this range single precision is too
/// coarse.
inline V8 sample_spherical_triangle(const V8& a, const V8& b, const V8& c, F8 solid_angle, Pair8 u) {
  // An arc from b to a point c' on the arc from a to c cuts off a part of the area. With the angle α at a, the part is
  // φ + α − π (Arvo's φ is A' − α with A' = part + π).
  const V8 across_b = cross(a, b), across_c = cross(a, c);
  const F8 scale = F8(1.0f) / sqrt(length_squared(across_b) * length_squared(across_c));
  const F8 cos_alpha = dot(across_b, across_c) * scale;
  const F8 sin_alpha = abs(dot(a, cross(b, c))) * scale;
  const SinCos8 part = sin_cos_turns(u.u * solid_angle * F8(0.5f * kInvPi));
  const F8 sin_phi = part.cos * sin_alpha - part.sin * cos_alpha;
  const F8 cos_phi = -(part.cos * cos_alpha + part.sin * sin_alpha);
  const F8 k1 = cos_phi + cos_alpha;
  const F8 k2 = sin_phi - sin_alpha * dot(a, b);
  const F8 quotient = (k2 + (k2 * cos_phi - k1 * sin_phi) * cos_alpha) / ((k2 * sin_phi + k1 * cos_phi) * sin_alpha);
  const F8 cos_arc = max(min(quotient, F8(1.0f)), F8(-1.0f));
  const V8 towards_c = normalize(c - a * dot(a, c));
  const V8 c2 = a * cos_arc + towards_c * sqrt(F8(1.0f) - cos_arc * cos_arc);
  // Uniform in the height of the cap around b, along the arc from b to c'.
  const F8 cos_theta = F8(1.0f) - u.v * (F8(1.0f) - dot(c2, b));
  const F8 sin_theta = sqrt(max(F8(1.0f) - cos_theta * cos_theta, F8(0.0f)));
  const V8 away = c2 - b * dot(c2, b);
  const F8 away2 = length_squared(away);
  const V8 towards_c2 = away * select(away2 > F8(0.0f), F8(1.0f) / sqrt(away2), F8(0.0f));
  return b * cos_theta + towards_c2 * sin_theta;
}

}  // namespace lightmill
