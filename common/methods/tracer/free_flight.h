// Sampled distance to the point where a medium scatters light.
#pragma once

#include "common/methods/tracer/drawn_channel.h"
#include "common/sampling/sobol.h"
#include "common/scene/compiled/medium_table.h"

namespace lightmill::tracer {

/// Free flights of eight paths along segments in media.
struct FreeFlight8 {
  M8 alive;     ///< lanes that carry light
  V8 share;     ///< of the channels in the light that is carried
  M8 event;     ///< lanes that scatter before the end of their segments
  F8 distance;  ///< to the point that scatters, in any lane. It can lie beyond the segment
  V8 until;     ///< transmittance up to there
  F8 pdf;       ///< density of the distance, per length
  V8 weight;    ///< of scattering there: scattering · until / pdf. Else of passing: transmittance / its probability
};

/// A channel is drawn by its share of the light, and its density draws the distance. The weight divides by the mean
/// density of the three channels (one-sample multiple importance sampling with the balance heuristic, Veach 1997,
/// 9.2.4). So the sum of the channels never grows. `left`: transmittance of the segments.
inline FreeFlight8 sample_free_flight(const V8& carried, M8 scatters, const V8& extinction, const V8& scattering,
                                      F8 length, const V8& left, Pair8 u) {
  FreeFlight8 out;
  const F8 total = carried.x + carried.y + carried.z;
  out.alive = total > F8(0.0f);
  out.share = carried * select(out.alive, F8(1.0f) / total, F8(0.0f));
  const F8 sigma = drawn_channel(extinction, out.share, u.u);
  const F8 infinity(std::numeric_limits<float>::infinity());
  out.distance = select(sigma > F8(0.0f), -log(F8(1.0f) - u.v) / sigma, infinity);
  out.event = scatters & (out.distance < length);
  out.until = MediumTable::transmittance(extinction, out.distance);
  out.pdf = dot(out.share, extinction * out.until);
  const F8 survival = dot(out.share, left);
  out.weight = select(out.event, scattering * out.until * (F8(1.0f) / out.pdf), left * (F8(1.0f) / survival));
  return out;
}

}  // namespace lightmill::tracer
