// Deterministic straight paths: what rays hit, and the transmittance up to there.
#pragma once

#include <functional>

#include "common/methods/see_through.h"

namespace lightmill {

/// Hits of eight rays, and what lies on the way.
struct Arrival8 {
  Hit8 hits;           ///< relative to `rays`; none in lanes that reach nothing
  Ray8 rays;           ///< the last segments
  Media8 media;        ///< in front of the hit
  Crossing8 crossing;  ///< at the hit, if it is a medium boundary; else its eta is 1
  V8 transmittance;    ///< of all segments
  V8 emission;         ///< radiance from emitting boundaries that did not stop the rays, as it arrives
};

/// Segments of eight straight paths, between boundaries.
struct MediaSegment8 {
  V8 origin;
  F8 length;
  Media8 media;
  std::uint32_t passed;  ///< boundaries before it
};
using TakeSegments = std::function<void(M8 lanes, const MediaSegment8& segments)>;

/// Traces rays of unit direction through boundaries that do not stop light, through surfaces as `passing` says, and
/// through all surfaces of the geometry `through`. Media remove what they absorb and scatter (Bouguer's law). Scattered
/// light is lost. `media` is ignored in scenes without media. In others, `take` gets all segments.
Arrival8 trace_transmittance(const CompiledScene& scene, M8 lanes, const Ray8& rays, const Media8& media,
                             Passing8 passing, std::uint32_t through, RenderCounters& counters,
                             const TakeSegments& take = {});

}  // namespace lightmill
