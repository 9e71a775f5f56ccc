// Transcendental functions with fixed bits. Code that decides samples uses only these, never the C library's.
#pragma once

#include "common/math/simd.h"

namespace lightmill {

inline constexpr float kPi = 3.14159265358979323846f;
inline constexpr float kInvPi = 0.31830988618379067154f;
inline constexpr double kPiDouble = 3.14159265358979323846;

struct SinCos8 {
  F8 sin, cos;
};

/// Sine and cosine for |x| <= π/4 + 1e-6. Absolute error below 1.2e-7. Taylor polynomials (degree 9 and 8).
inline SinCos8 sin_cos_quarter(F8 x) {
  const F8 x2 = x * x;
  F8 s = F8(2.7557319e-6f);
  s = s * x2 + F8(-1.9841270e-4f);
  s = s * x2 + F8(8.3333333e-3f);
  s = s * x2 + F8(-1.6666667e-1f);
  s = s * x2 * x + x;
  F8 c = F8(2.4801587e-5f);
  c = c * x2 + F8(-1.3888889e-3f);
  c = c * x2 + F8(4.1666667e-2f);
  c = c * x2 + F8(-0.5f);
  c = c * x2 + F8(1.0f);
  return {s, c};
}

/// Sine and cosine of 2π·u for u in [0, 1].
SinCos8 sin_cos_turns(F8 u);

/// The angle of (x, y) in [−π, π]. Relative error below 3e-7. 0 if both are 0.
F8 atan2(F8 y, F8 x);

// Doubles, for values that are computed once per scene. Relative error below 1e-14 in these ranges:
double sin_fixed(double x);              ///< |x| <= 1e4
double cos_fixed(double x);              ///< |x| <= 1e4
double one_minus_cos_fixed(double x);    ///< |x| <= 1e4; accurate also for small x
double tan_fixed(double x);              ///< |x| < π/2
double atan2_fixed(double y, double x);  ///< error below 1e-14; 0 if both are 0
double exp_fixed(double x);              ///< |x| <= 700
double cube_root_fixed(double x);        ///< positive normal x

}  // namespace lightmill
