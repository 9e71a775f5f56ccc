// One batch of one sample: its paths are traced and shaded together, bounce by bounce.
#pragma once

#include <array>

#include "common/materials/bsdf.h"
#include "common/methods/film_channels.h"
#include "common/methods/method.h"
#include "common/methods/path/connection_queue.h"
#include "common/methods/path/queues.h"
#include "common/methods/path/sample_plan.h"
#include "common/methods/photons/light_side.h"
#include "common/methods/sample_sums.h"

namespace lightmill::path {

inline constexpr std::size_t kBatchPixels =
    1024;  ///< camera rays in flight: large enough for full lanes, small enough for the cache

class PathWorkspace final : public Workspace {
 public:
  PathQueue paths, next;
  ShadowQueue shadows;
  ConnectionQueue connections;
  SampleSums sums;
  std::array<std::vector<std::uint32_t>, 2> pixel_seeds;  ///< one array a half
  std::vector<float> radiance;  ///< of one sample of the tile: planes of one value a slot, beauty's first
  std::vector<float> first;     ///< planes of one value a pixel of layers that are made of samples 0 to 15
  std::array<std::vector<std::uint32_t>, 8> found;  ///< deposits near each lane
  std::vector<const photons::Splat*> splats;
};

/// Up to eight paths at the surfaces they have found, and what shading them needs.
struct Vertex8 {
  const Path8& in;
  const Surface8& surface;
  V8 facing;     ///< the geometric normal on the ray's side
  Frame8 frame;  ///< around the shading normal on the ray's side
  std::uint32_t bounce;
  Crossing8 crossing = {};  ///< of boundaries of media, where the scene has such
  M8 casters = {};          ///< where there is a light side
  // Where paths are connected: what they bring, and the merging factor there.
  vcm::Partial8 partial{F8(0.0f), F8(0.0f)};
  F8 merging = F8(0.0f);
};

/// Length of the ray that has found the vertex.
inline F8 way_to(const Vertex8& vertex) {
  return sqrt(length_squared(vertex.surface.point - vertex.in.origin));
}

/// Holds what all steps of a batch need. `shade_kind` is the one place that knows which materials there are.
class Batch {
 public:
  Batch(const CompiledScene& scene, const FilmChannels& channels, const PixelRect& tile, const SamplePlan& plan,
        std::uint32_t max_bounces, const photons::LightPass* light_pass, PathWorkspace& ws)
      : scene_(scene),
        channels_(channels),
        tile_(tile),
        plan_(plan),
        meter_(is_meter_rect(tile) ? &scene.meters().at(meter_of(tile)) : nullptr),
        max_bounces_(max_bounces + (meter_ != nullptr && !meter_->looks ? 1 : 0)),  // a meter's own surface is none
        light_pass_(light_pass),
        ws_(ws),
        pixels_(static_cast<std::uint32_t>(tile.pixel_count())),
        slots_(pixels_ * plan.splits) {}

  /// Adds the light of the tile's pixels [first, last) to the workspace's radiance.
  void run(std::size_t first_pixel, std::size_t last_pixel, const std::vector<std::uint32_t>& seeds);
  /// Adds what the light side brings to the tile without camera paths: deposits that are seen directly, or photons that
  /// have crossed the meter.
  void add_light_pass();

 private:
  void start(std::size_t first_pixel, std::size_t last_pixel, const std::vector<std::uint32_t>& seeds);
  std::uint32_t start_meter(std::size_t first_pixel, std::size_t last_pixel, const std::vector<std::uint32_t>& seeds);
  template <class ChannelOf>
  void add_to_planes(M8 lanes, U8 slot, const V8& value, const ChannelOf& channel_of);
  void add_to_plane(int channel, M8 lanes, U8 slot, const V8& value);
  void add_light(M8 lanes, U8 slot, const V8& value, bool direct);
  void add_to_group(M8 lanes, U8 slot, U8 group, const V8& value);
  void add_not_finite(M8 lost, U8 slot);
  void add_untraceable(M8 lanes, const Ray8& rays, U8 slot);
  void add_emission(const Path8& in, const Hit8& hits, const Surface8& surface, std::uint32_t bounce);
  void add_environment(const Path8& in, M8 escaped, std::uint32_t bounce);
  void add_background(const Path8& in, M8 lanes, const V8& radiance, std::uint32_t bounce);
  /// Paths that holdouts have ended see what they meet, and go no further.
  static M8 goes_on(const Path8& in) { return in.roulette_scale < F8(std::numeric_limits<float>::infinity()); }
  void shade(const Path8& in, M8 lanes, std::uint32_t bounce);
  /// How paths get to what they hit.
  struct Passage8 {
    V8 origin;           ///< of the last part of the way: hits are as seen from there
    F8 before;           ///< length of the way up to there
    Crossing8 crossing;  ///< of what is hit, where the scene has media
    M8 scattered;        ///< in a medium before, at `point`
    V8 point;
  };
  void shade_hits(const Path8& in, M8 lanes, const Hit8& hits, std::uint32_t bounce, const Passage8& passage);
  void shade_kind(MaterialKind kind, const Vertex8& vertex, M8 lanes);
  void shade_holdout(const Vertex8& vertex, M8 lanes);
  Passage8 pass_media(Path8& paths, M8 lanes, Hit8& hits, std::uint32_t bounce);
  M8 travel(Path8& paths, M8 lanes, F8 length, std::uint32_t decision, F8& scattered_at);
  void shade_medium(const Path8& in, const V8& point, M8 lanes, std::uint32_t bounce);
  V8 light_through_media(const Shadow8& shadows, M8 lanes, M8 blocked);

  /// Next-event estimation and going on, for a BSDF that has a density (common/materials/bsdf.h).
  template <class Bsdf>
  void shade_scattering(const Vertex8& vertex, const Bsdf& bsdf, const V8& wo, M8 lanes);
  Pair8 decide(U8 index, U8 pixel_seed, std::uint32_t vertex, std::uint32_t decision) const {
    return path::decide(index, pixel_seed, vertex, decision, plan_.sobol_vertices);
  }
  LightSample8 draw_light(const V8& point, U8 index, U8 pixel_seed, std::uint32_t bounce) const;
  U8 shadow_slot(U8 slot, const LightSample8& light, M8 lanes) const;
  template <class Bsdf>
  void sample_light(const Vertex8& vertex, const Bsdf& bsdf, const V8& wo, M8 lanes);
  /// For a delta BSDF: one way to go on, no light to sample.
  void go_on_specular(const Vertex8& vertex, const Path8& start, const BsdfSample8& sample, M8 lanes);
  static Path8 specular_start(const Vertex8& vertex);
  void leave(const Vertex8& vertex, const BsdfSample8& sample, Path8& out, M8 lanes);
  void go_on(Path8& out, M8 lanes, std::uint32_t bounce);
  void trace_shadows(std::uint32_t bounce);

  /// All that surfaces which are no casters receive is the light side's: camera paths end there.
  bool photons_bring_all() const {
    return light_pass_ != nullptr && light_pass_->followed == photons::Followed::all_light;
  }
  /// Light paths are connected and merged with those from the eye.
  bool connects() const { return light_pass_ != nullptr && light_pass_->followed == photons::Followed::paths; }
  F8 found_light_weight(const Path8& in, U8 light, const V8& point, F8 cosine, std::uint32_t bounce, M8 lanes) const;
  template <class Bsdf>
  F8 sampled_light_weight(const Vertex8& vertex, const Bsdf& bsdf, const V8& wo, const V8& wi,
                          const LightSample8& light, M8 lanes) const;
  template <class Bsdf>
  void connect(const Vertex8& vertex, const Bsdf& bsdf, const V8& wo, M8 lanes);
  void trace_connections();
  void add_brought(M8 lanes, U8 slot, const photons::Deposit8& deposits, const V8& value, std::uint32_t bounce);

  /// Light whose path starts over casters and then stays: it is the light side's, where there is one.
  void add_caustic(M8 lanes, U8 slot, U8 group, const V8& value);
  void add_splats();
  void add_meter_hits();
  /// What of the deposits near the vertices, which are first seen over casters, goes on to the eye.
  template <class Bsdf>
  void gather_deposits(const Vertex8& vertex, const Bsdf& bsdf, const V8& wo, M8 lanes);
  template <class Map, class Bsdf>
  void gather_from(const Map& map, F8 radius, const Vertex8& vertex, const Bsdf& bsdf, const V8& wo, M8 lanes);
  template <class Map>
  void find_near(const Map& map, const V8& point, F8 radius, M8 lanes);
  template <class Bsdf>
  void add_found(F8 radius, const Vertex8& vertex, const Bsdf& bsdf, const V8& wo, M8 lanes);

  const CompiledScene& scene_;
  const FilmChannels& channels_;
  const PixelRect& tile_;
  const SamplePlan& plan_;
  const MeterPlace* const meter_;  ///< null for tiles of the picture
  const std::uint32_t max_bounces_;
  const photons::LightPass* const light_pass_;  ///< null where the camera side finds all light
  PathWorkspace& ws_;
  const std::uint32_t pixels_;
  const std::uint32_t slots_;
};

}  // namespace lightmill::path
