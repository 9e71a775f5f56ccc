// Straight ways, without random numbers: what rays meet, what is absorbed before, what does not stop them.
#pragma once

#include "common/methods/method.h"

namespace lightmill {

inline constexpr std::uint32_t kNoGeometry = 0xffffffff;

/// Where eight rays have got to.
struct Arrival8 {
  Hit8 hits;           ///< as seen from `rays`; of lanes that nothing has stopped there is none
  Ray8 rays;           ///< their last part
  Media8 media;        ///< in front of what was hit
  Crossing8 crossing;  ///< of what was hit, where it is the boundary of a medium; else its eta is 1
  V8 transmittance;    ///< of all of the way
  V8 emission;         ///< radiance that boundaries which did not stop the rays have added, as it arrives
};

/// Follows rays (of unit direction) through boundaries that light does not notice, and through all surfaces of the
/// geometry `through`. In media Bouguer's law takes off what is absorbed and what is scattered; scattered light is
/// lost. Where the scene has no media `media` is not looked at.
Arrival8 travel(const CompiledScene& scene, M8 lanes, const Ray8& rays, const Media8& media, std::uint32_t through,
                RenderCounters& counters);

}  // namespace lightmill
