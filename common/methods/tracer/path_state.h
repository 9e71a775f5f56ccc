// State of the tracer's paths: what waits in its queues, and the surfaces that paths have reached.
#pragma once

#include "common/materials/bsdf.h"
#include "common/methods/tracer/lane_queue.h"
#include "common/scene/compiled/compiled_scene.h"

namespace lightmill::tracer {

/// Eight paths that wait for their next ray. An estimator whose paths carry more derives from its payload and from
/// this, in this order: the media come last, because only scenes that have media store them.
struct Path8 {
  struct AtVertex {};  ///< what the estimator needs to know at a surface: nothing

  V8 origin, direction;
  V8 throughput;       ///< divided by the number of paths that the camera ray was split into
  F8 pdf_solid_angle;  ///< of `direction` by the last BSDF; 0 after a delta BSDF or from the camera
  F8 roulette_scale;   ///< Russian roulette decides by throughput times this: splits, and η² of refractions
  U8 slot;             ///< where its light is added: split · pixels of the tile + pixel
  U8 pixel_seed;
  U8 index;  ///< point of the path's sequences
  Media8 media;
};
/// Queue of rows that end with media.
template <class Row8>
using MediaQueue = LaneQueue<Row8, sizeof(Media8) / sizeof(F8)>;

/// Slots are below 2^15 (eight split paths of 64×64 pixels). The bits above hold the number of a light group.
inline constexpr int kGroupShift = 16;

/// Eight shadow rays, and the light that they bring if nothing is in their way.
struct Shadow8 {
  V8 origin, direction;  ///< the light is at distance 1, in lengths of `direction`
  V8 contribution;
  U8 slot;  ///< with the light group's number from kGroupShift on, where the film separates lights
  Media8 media;
};

/// Up to eight paths at surfaces, and what shading them needs.
struct Vertex8 {
  const Path8& in;
  const Surface8& surface;
  V8 facing;     ///< the geometric normal on the ray's side
  Frame8 frame;  ///< around the shading normal on the ray's side
  std::uint32_t bounce;
  Crossing8 crossing = {};  ///< of boundaries of media, where the scene has such
};
/// The same with what the paths of an estimator carry.
template <class Path>
struct PathVertex8 : Vertex8 {
  const Path& path;
  [[no_unique_address]] typename Path::AtVertex at = {};
};

/// Whether a BSDF can scatter to `wi`: both normals must agree on its side. `side`: cosine to the geometric one.
template <class Bsdf>
M8 scatters_to(const V8& wi, F8 side) {
  const M8 above = (wi.z > F8(0.0f)) & (side > F8(0.0f));
  if constexpr (Bsdf::kTransmits) {
    return above | ((wi.z < F8(0.0f)) & (side < F8(0.0f)));
  } else {
    return above;
  }
}

/// A holdout ends the paths that leave it: they see what they meet, and are not scattered again.
inline constexpr float kEndedScale = std::numeric_limits<float>::infinity();
inline M8 continues(const Path8& path) {
  return path.roulette_scale < F8(kEndedScale);
}

}  // namespace lightmill::tracer
