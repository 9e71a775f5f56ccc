#include "common/math/transcendental.h"

#include <cmath>

namespace lightmill {
namespace {

struct SinCos {
  double sin, cos;
};

/// Taylor series for |x| <= π/4. The remainder of degree 19 is below 1e-19.
SinCos sin_cos_reduced(double x) {
  const double x2 = x * x;
  double s = 0, c = 0;
  for (int k = 9; k >= 0; --k) {
    s = 1.0 - s * x2 / ((2.0 * k + 2.0) * (2.0 * k + 3.0));
    c = 1.0 - c * x2 / ((2.0 * k + 1.0) * (2.0 * k + 2.0));
  }
  return {s * x, c};
}

SinCos sin_cos_fixed(double x) {
  // π/2 in two parts (Cody and Waite), so that the reduction is exact to about 2^-86 of a quadrant.
  const double quadrant = std::nearbyint(x * (2.0 / kPiDouble));
  const double reduced = (x - quadrant * 1.57079632673412561417) - quadrant * 6.07710050650619224932e-11;
  const SinCos r = sin_cos_reduced(reduced);
  switch (static_cast<long>(quadrant) & 3) {
    case 0:
      return {r.sin, r.cos};
    case 1:
      return {r.cos, -r.sin};
    case 2:
      return {-r.sin, -r.cos};
    default:
      return {-r.cos, r.sin};
  }
}

}  // namespace

SinCos8 sin_cos_turns(F8 u) {
  // Quadrant q = round(4u); the rest is within an eighth of a turn of zero.
  const F8 scaled = u * F8(4.0f);
  const U8 quadrant(_mm256_cvtps_epi32(scaled.v));
  const F8 rest = (scaled - to_float(quadrant)) * F8(kPi / 2);
  const SinCos8 r = sin_cos_quarter(rest);
  const M8 swap = (quadrant & U8(1)) == U8(1);
  const F8 s = select(swap, r.cos, r.sin);
  const F8 c = select(swap, r.sin, r.cos);
  const U8 sin_sign = (quadrant & U8(2)) << 30;
  const U8 cos_sign = ((quadrant + U8(1)) & U8(2)) << 30;
  return {bits_float(float_bits(s) ^ sin_sign), bits_float(float_bits(c) ^ cos_sign)};
}

F8 atan2(F8 y, F8 x) {
  const F8 ax = abs(x), ay = abs(y);
  const F8 large = max(ax, ay), small = min(ax, ay);
  // atan of a ratio in [0, 1], reduced about 1 if it is above tan(π/8). The polynomial is that of Cephes' atanf.
  const F8 ratio = select(large > F8(0.0f), small / large, F8(0.0f));
  const M8 upper = ratio > F8(0.41421356f);
  const F8 t = select(upper, (small - large) / (small + large), ratio);
  const F8 t2 = t * t;
  F8 a = F8(8.05374449538e-2f);
  a = a * t2 + F8(-1.38776856032e-1f);
  a = a * t2 + F8(1.99777106478e-1f);
  a = a * t2 + F8(-3.33329491539e-1f);
  a = a * t2 * t + t + masked(upper, F8(kPi / 4));
  a = select(ay > ax, F8(kPi / 2) - a, a);
  a = select(x < F8(0.0f), F8(kPi) - a, a);
  return copysign(a, y);
}

double sin_fixed(double x) {
  return sin_cos_fixed(x).sin;
}
double cos_fixed(double x) {
  return sin_cos_fixed(x).cos;
}
double one_minus_cos_fixed(double x) {
  const double half = sin_fixed(x / 2);
  return 2 * half * half;
}
double atan2_fixed(double y, double x) {
  const double length = std::sqrt(x * x + y * y);
  if (!(length > 0)) {
    return 0;
  }
  // A first guess in single precision. With its error near 1e-6, the sine of the error is exact to the third power.
  alignas(32) float lanes[8];
  atan2(F8(static_cast<float>(y / length)), F8(static_cast<float>(x / length))).store(lanes);
  const SinCos guess = sin_cos_fixed(lanes[0]);
  return lanes[0] + (y * guess.cos - x * guess.sin) / length;
}
double tan_fixed(double x) {
  const SinCos r = sin_cos_fixed(x);
  return r.sin / r.cos;
}

double exp_fixed(double x) {
  // x = k·ln 2 + r with |r| <= ln 2 / 2, ln 2 in two parts.
  const double k = std::nearbyint(x * 1.44269504088896340736);
  const double r = (x - k * 6.93147180369123816490e-01) - k * 1.90821492927058770002e-10;
  double sum = 1.0;
  for (int n = 16; n >= 1; --n) {
    sum = 1.0 + sum * r / n;
  }
  return std::ldexp(sum, static_cast<int>(k));
}

double cube_root_fixed(double x) {
  // x = m · 8^k with m in [1, 8). Newton's method starts above the root, where it only falls.
  const int exponent = std::ilogb(x);
  const int k = exponent >= 0 ? exponent / 3 : -((2 - exponent) / 3);
  const double m = std::ldexp(x, -3 * k);
  double root = 2;
  for (int i = 0; i < 8; ++i) {
    root -= (root - m / (root * root)) / 3;
  }
  return std::ldexp(root, k);
}

}  // namespace lightmill
