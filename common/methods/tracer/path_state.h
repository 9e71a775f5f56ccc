// State of the tracer's paths: queue entries, and vertices.
#pragma once

#include "common/materials/bsdf.h"
#include "common/methods/shading_frame.h"
#include "common/methods/tracer/lane_queue.h"
#include "common/scene/compiled/compiled_scene.h"

namespace lightmill::tracer {

/// Eight paths in the queue. An estimator with more state per path derives from its payload and then from this. The
/// media must come last, because only scenes with media store them.
struct Path8 {
  struct AtVertex {};  ///< what the estimator needs at a surface: nothing

  V8 origin, direction;
  V8 throughput;       ///< divided by the number of split paths
  F8 pdf_solid_angle;  ///< of `direction`, by the last BSDF; 0 from the camera or after a delta BSDF
  F8 roulette_scale;   ///< Russian roulette decides by throughput times this: number of splits, and η² of refractions
  U8 slot;             ///< where its light is added: split · pixels of the tile + pixel
  U8 pixel_seed;
  U8 index;  ///< point of the path's sequences
  Media8 media;
};
/// Queue of rows that end with media.
template <class Row8>
using MediaQueue = LaneQueue<Row8, sizeof(Media8) / sizeof(F8)>;

/// Slots are below 2^15 (eight split paths of 64×64 pixels). The bits from here on have the number of a light group.
inline constexpr int kGroupShift = 16;

/// Eight shadow rays, with the light that they bring if nothing occludes them.
struct Shadow8 {
  V8 origin, direction;  ///< not normalised: the light is at distance 1
  V8 contribution;
  U8 slot;  ///< from bit kGroupShift on the light group, if the film separates lights
  Media8 media;
};

/// Up to eight paths at surfaces, with what shading needs.
struct Vertex8 : ShadingFrame8 {
  const Path8& in;
  const Surface8& surface;
  std::uint32_t bounce;
  const Crossing8& crossing;  ///< of medium boundaries, in scenes with media
};
/// The same, with the state of an estimator's paths.
template <class Path>
struct PathVertex8 : Vertex8 {
  const Path& path;
  [[no_unique_address]] typename Path::AtVertex at = {};
};

/// Marks paths that left a shadow catcher. They count the light that they hit, and end there.
inline constexpr float kEndedScale = std::numeric_limits<float>::infinity();
inline M8 continues(const Path8& path) {
  return path.roulette_scale < F8(kEndedScale);
}

}  // namespace lightmill::tracer
