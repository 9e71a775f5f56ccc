// Rays that meet surfaces with an opacity below 1.
//
// Such a surface stops a path with the probability of its opacity. Otherwise the path continues unchanged. One random
// number per segment decides: the path passes surfaces, nearest first, while the product of their 1 − opacity is above
// the number. This samples the stopping surface by inversion, like a free path in a medium. A decision is a function of
// the path's seed, the vertex and what lies on the ray. It does not depend on the order in which the hierarchy finds
// hits, nor on the numbers of primitives.
//
// Shadow rays and connections draw nothing. They pass every surface that does not stop all light, and carry the product
// of 1 − opacity. That is the mean of the decisions, without their noise.
#pragma once

#include "common/methods/method.h"

namespace lightmill {

inline constexpr std::uint32_t kNoGeometry = 0xffffffff;
/// Limit of surfaces or boundaries that one ray passes in a row. The ray stops at the next one.
inline constexpr std::uint32_t kMaxPassed = 1000;

/// The decision of a path's segment to vertex v. The numbers lie between connection_decision and kLensDecision
/// (tracer/sample_plan.h).
constexpr std::uint32_t opacity_decision(std::uint32_t vertex) {
  return 0x38000000u + vertex;
}

/// The decision that draws the part of a mixture at vertex v. The numbers lie above those of opacity_decision.
constexpr std::uint32_t mixture_decision(std::uint32_t vertex) {
  return 0x3c000000u + vertex;
}

/// The end of connections: points on surfaces.
struct Target8 {
  V8 point;
  U8 geometry, primitive;
  F8 distance;  ///< from the start of the connection
};
/// The lanes whose hits are the target. A ray can meet a sphere twice, and both points have the same primitive. The
/// distance tells them apart, beyond rounding. `cosine`: of the ray to the geometric normal, positive.
inline M8 reaches(const Target8& target, const Hit8& hits, const Surface8& surface, F8 cosine) {
  const V8 off = surface.point - target.point;
  const F8 tolerance = (surface.offset * F8(256.0f) + target.distance * F8(0x1p-16f)) / max(cosine, F8(1e-3f));
  return hits.hit & (hits.geometry == target.geometry) & (hits.primitive == target.primitive) &
         (length_squared(off) < tolerance * tolerance);
}

/// State of eight rays that pass surfaces until one stops them.
struct Passing8 {
  bool decides = false;                         ///< else the light on the rays is multiplied by `left`
  F8 number = F8(0.0f);                         ///< the random number; 0 if nothing is decided
  F8 left = F8(1.0f);                           ///< product of 1 − opacity of all surfaces passed so far
  const Target8* target = nullptr;              ///< always stops the rays
  std::uint32_t opaque_geometry = kNoGeometry;  ///< its surfaces always stop the rays

  static Passing8 decided_by(F8 number) { return {true, number}; }
};

/// Moves hits of unit rays on to the surfaces that stop the rays. Rays keep their origins, so a passed surface does not
/// change the hits behind it.
Hit8 pass_surfaces(const CompiledScene& scene, M8 lanes, const Ray8& rays, Hit8 hits, Passing8& passing,
                   RenderCounters& counters);

/// The nearest surfaces that stop unit rays. `counters` get the rays beyond the first ones.
inline Hit8 nearest_stop(const CompiledScene& scene, M8 lanes, const Ray8& rays, bool coherent, Passing8& passing,
                         RenderCounters& counters) {
  const Hit8 hits = scene.accel().intersect(lanes, rays, coherent);
  return scene.features().opacity ? pass_surfaces(scene, lanes, rays, hits, passing, counters) : hits;
}

/// The share of light that surfaces let pass along the rays of `blocked`, which meet some. 0 in other lanes. Rays need
/// not be unit vectors.
F8 share_passed(const CompiledScene& scene, M8 blocked, const Ray8& rays, RenderCounters& counters);

}  // namespace lightmill
