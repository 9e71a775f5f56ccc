// Cost of rendering, counted instead of timed, so that all machines get the same result.
#pragma once

#include "common/methods/method.h"

namespace lightmill {

/// Cost of a shadow ray, which need not find the closest hit. On the Cornell box, Embree traces 22 million incoherent
/// shadow rays and 11.5 million closest-hit rays a second, eight at a time. Shading adds to closest hits.
inline constexpr double kShadowRayCost = 0.5;

/// In units of one closest-hit ray of a camera path.
struct CountedCost {
  double own = 0;     ///< of the rendered pixels
  double shared = 0;  ///< of all pixels of a sample together: photons
};
CountedCost cost_of(const RenderCounters& counters);

}  // namespace lightmill
