// Straight paths without random numbers: what rays hit, the transmittance up to there, and what does not stop them.
#pragma once

#include "common/methods/method.h"

namespace lightmill {

inline constexpr std::uint32_t kNoGeometry = 0xffffffff;

/// Where eight rays have arrived.
struct Arrival8 {
  Hit8 hits;           ///< as seen from `rays`; of lanes that nothing has stopped there is none
  Ray8 rays;           ///< the last segments
  Media8 media;        ///< in front of what was hit
  Crossing8 crossing;  ///< of what was hit, where it is the boundary of a medium; else its eta is 1
  V8 transmittance;    ///< of all segments
  V8 emission;         ///< radiance that boundaries have added which did not stop the rays, as it arrives
};

/// Traces rays (of unit direction) through boundaries that do not stop light, and through all surfaces of the geometry
/// `through`. Media take off what they absorb and what they scatter (Bouguer's law); scattered light is lost. `media`
/// is ignored where the scene has none.
Arrival8 trace_transmittance(const CompiledScene& scene, M8 lanes, const Ray8& rays, const Media8& media,
                             std::uint32_t through, RenderCounters& counters);

}  // namespace lightmill
