// Exponentials and logarithms in eight lanes, with fixed bits. Polynomials and range reductions of Cephes (Moshier
// 1989).
#pragma once

#include "common/math/simd.h"

namespace lightmill {
namespace detail {

/// e^r − 1 for |r| <= ln 2 / 2.
inline F8 exp_minus_one_reduced(F8 r) {
  F8 p = F8(1.9875691500e-4f);
  p = p * r + F8(1.3981999507e-3f);
  p = p * r + F8(8.3334519073e-3f);
  p = p * r + F8(4.1665795894e-2f);
  p = p * r + F8(1.6666665459e-1f);
  p = p * r + F8(5.0000001201e-1f);
  return p * (r * r) + r;
}

struct ExpParts8 {
  F8 fraction_minus_one;  ///< e^r − 1
  F8 scale;               ///< 2^k
  M8 reduced;             ///< k is not 0
};

/// e^x = scale · (1 + fraction_minus_one) for -87.3 <= x <= 88.3.
inline ExpParts8 exp_parts(F8 x) {
  const F8 k(_mm256_round_ps((x * F8(1.44269504f)).v, _MM_FROUND_TO_NEAREST_INT | _MM_FROUND_NO_EXC));
  const F8 r = (x - k * F8(0.693359375f)) - k * F8(-2.12194440e-4f);
  const U8 exponent(_mm256_cvtps_epi32(k.v));
  return {exp_minus_one_reduced(r), bits_float((exponent + U8(127u)) << 23), ~(k == F8(0.0f))};
}

}  // namespace detail

inline constexpr float kSmallestExpArgument = -87.3f;  ///< below, e^x counts as 0
inline constexpr float kLargestExpArgument = 88.3f;    ///< above, e^x is the value here

/// e^x. Relative error below 2e-7. 0 below kSmallestExpArgument (also for −∞), e^88.3 above kLargestExpArgument.
inline F8 exp(F8 x) {
  const F8 clamped = min(max(x, F8(kSmallestExpArgument)), F8(kLargestExpArgument));
  const detail::ExpParts8 parts = detail::exp_parts(clamped);
  return masked(x >= F8(kSmallestExpArgument), parts.scale + parts.scale * parts.fraction_minus_one);
}

/// e^x − 1 without cancellation. Relative error below 4e-7. −1 far below 0, and limited above as `exp`.
inline F8 expm1(F8 x) {
  const F8 clamped = min(max(x, F8(kSmallestExpArgument)), F8(kLargestExpArgument));
  const detail::ExpParts8 parts = detail::exp_parts(clamped);
  return select(parts.reduced, parts.scale * parts.fraction_minus_one + (parts.scale - F8(1.0f)),
                parts.fraction_minus_one);
}

/// The natural logarithm of positive normal numbers. Error below 2e-7 of |ln x|. Smaller numbers, zero and negative
/// ones included, count as 2^-126 (ln = −87.34).
inline F8 log(F8 x) {
  const U8 bits = float_bits(max(x, F8(0x1p-126f)));
  // x = m · 2^e with m in [√½, √2).
  const U8 shifted = bits + U8(0x3f800000u - 0x3f3504f3u);
  const F8 e = to_float((shifted >> 23) - U8(127u));
  const F8 m = bits_float((shifted & U8(0x007fffffu)) + U8(0x3f3504f3u)) - F8(1.0f);
  F8 p = F8(7.0376836292e-2f);
  p = p * m + F8(-1.1514610310e-1f);
  p = p * m + F8(1.1676998740e-1f);
  p = p * m + F8(-1.2420140846e-1f);
  p = p * m + F8(1.4249322787e-1f);
  p = p * m + F8(-1.6668057665e-1f);
  p = p * m + F8(2.0000714765e-1f);
  p = p * m + F8(-2.4999993993e-1f);
  p = p * m + F8(3.3333331174e-1f);
  const F8 m2 = m * m;
  const F8 tail = (p * m * m2 + e * F8(-2.12194440e-4f)) - F8(0.5f) * m2;
  return (m + tail) + e * F8(0.693359375f);
}

/// ln(1 + y) for y > −1 without cancellation. Relative error below 4e-7. Uses Kahan's correction of ln(1 ⊕ y) for the
/// rounding of the sum (Higham 2002, "Accuracy and Stability of Numerical Algorithms", 1.14.1).
inline F8 log1p(F8 y) {
  const F8 w = F8(1.0f) + y;
  const F8 rounded = w - F8(1.0f);
  const F8 corrected = log(w) * (y / rounded);
  return select(rounded == F8(0.0f), y, corrected);
}

/// x^y for x >= 0 and y >= 0. Relative error below 3e-7 · (1 + |ln of the result|). 0^0 is 1.
inline F8 pow(F8 x, F8 y) {
  return select(y == F8(0.0f), F8(1.0f), masked(x > F8(0.0f), exp(y * log(x))));
}

/// x^y for x in [0, 1], given as 1 − x, and y >= 0. The error is about 1e-7 · (1 + |y ln x|), also for x that single
/// precision cannot tell from 1. 0^0 is 1.
inline F8 pow_one_minus(F8 one_minus_x, F8 y) {
  return select(y == F8(0.0f), F8(1.0f), exp(y * log1p(-one_minus_x)));
}

}  // namespace lightmill
