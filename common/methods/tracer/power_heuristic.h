// The power heuristic of multiple importance sampling.
#pragma once

#include "common/math/simd.h"

namespace lightmill::tracer {

/// Weight of the first technique by the power heuristic with β = 2 (Veach 1997, eq. 9.13). Both densities have the same
/// measure.
inline F8 power_heuristic(F8 pdf, F8 other_pdf) {
  const F8 ratio = other_pdf / pdf;
  return F8(1.0f) / (F8(1.0f) + ratio * ratio);
}

}  // namespace lightmill::tracer
