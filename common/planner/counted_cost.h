// What rendering costs, counted and not timed, so that every machine comes to the same.
#pragma once

#include "common/methods/method.h"

namespace lightmill {

/// Of a shadow ray, which needs not find the nearest: Embree's own speeds with incoherent rays, eight at a time, on the
/// Cornell box are 22 and 11.5 million a second, and shading comes to the closest hits.
inline constexpr double kShadowRayCost = 0.5;

/// In units of one closest-hit ray of a camera path.
struct CountedCost {
  double own = 0;     ///< of the pixels that were rendered
  double shared = 0;  ///< once for all pixels of a sample: photons
};
CountedCost cost_of(const RenderCounters& counters);

}  // namespace lightmill
