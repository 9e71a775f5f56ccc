// Part of the wavefront path tracer that depends neither on the estimator nor on BSDFs: film planes, light samples,
// shadow rays and media.
#pragma once

#include <functional>

#include "common/methods/sampled_method.h"
#include "common/methods/see_through.h"
#include "common/methods/tracer/path_state.h"
#include "common/methods/tracer/sample_plan.h"

namespace lightmill::tracer {

/// `radiance` has planes of one value per slot.
struct WavefrontWorkspace : SampleWorkspace {
  MediaQueue<Shadow8> shadows;
};

/// The way from a path's origin to its hit, through boundaries.
struct Passage8 {
  V8 origin;           ///< of the last segment; hits are relative to it
  F8 before;           ///< length of earlier segments
  Crossing8 crossing;  ///< at the hit, in scenes with media
  M8 scattered;        ///< lanes that scatter in a medium before the hit, at `point`
  V8 point;
  U8 medium;         ///< that scatters them
  F8 density_ratio;  ///< there, of the points of next-event estimation over the points of scattering, per length
};

/// One sample of one tile. Not thread-safe.
class Wavefront {
 public:
  Wavefront(const CompiledScene& scene, const FilmChannels& channels, const PixelRect& tile, const SamplePlan& plan,
            std::uint32_t max_bounces, WavefrontWorkspace& ws);

  const CompiledScene& scene() const { return scene_; }
  const FilmChannels& channels() const { return channels_; }
  const PixelRect& tile() const { return tile_; }
  std::uint32_t max_bounces() const { return max_bounces_; }
  /// Null for tiles of the picture.
  const CompiledMeter* meter() const { return meter_; }
  /// The tile is an irradiance meter. Its paths start on a surface that no ray meets.
  bool on_irradiance_meter() const { return meter_ != nullptr && !meter_->measures_radiance; }

  /// Adds light that reaches the camera. `direct`: it was scattered at most once. `group`: its light group.
  void add_light(M8 lanes, U8 slot, const V8& value, bool direct, U8 group);
  /// Adds light of photons. In films with the layer `caustic`, photons were scattered at least twice.
  void add_photons(M8 lanes, U8 slot, const V8& value, U8 group);
  /// Adds light of the environment.
  void add_background(const Path8& in, M8 lanes, const V8& radiance, std::uint32_t bounce);
  /// Adds to the three planes of one layer.
  void add_to_layer(int channel, M8 lanes, U8 slot, const V8& value);
  /// Makes samples with untraceable rays NaN, so that the film counts them. Only degenerate geometry makes such rays.
  void add_untraceable(M8 lanes, const Ray8& rays, U8 slot);

  /// Sums split paths in ascending order. Planes of one value per slot become planes of one value per pixel.
  void sum_splits();

  Pair8 decide(const Path8& path, std::uint32_t vertex, std::uint32_t decision) const {
    return tracer::decide(path.index, path.pixel_seed, vertex, decision, plan_.sobol_vertices);
  }
  /// Samples a light and a point on it, as seen from `point`. `normal` and `draw`: as in LightTable::sample.
  LightSample8 draw_light(const V8& point, const V8& normal, const Path8& path, std::uint32_t bounce,
                          std::uint32_t draw) const;
  /// Next-event estimation: queues the light of sampled points, times `weight(light, wi, lanes)` for each image wi.
  template <class Bsdf, class Weight>
  void sample_lights(const Vertex8& vertex, const Bsdf& bsdf, const V8& wo, M8 lanes, const Weight& weight) {
    for (std::uint32_t draw = 0; draw < scene_.lights().draws(); ++draw) {
      sample_light(vertex, bsdf, wo, lanes, weight, draw);
    }
  }

  /// Queues shadow rays from `origin` to sampled lights.
  void push_shadows(M8 lanes, const V8& origin, const LightSample8& light, const V8& contribution, U8 slot,
                    const Media8& media);
  void trace_shadows(std::uint32_t bounce);
  /// Adds the radiance of an intersectable light that paths meet at `point`, where no surface is before it.
  void add_unoccluded(const Path8& in, M8 lanes, std::uint32_t light_index, const V8& point, const V8& light,
                      std::uint32_t bounce);

 protected:
  /// Adds the emission of boundaries that do not stop the paths.
  using AddEmission = std::function<void(const Hit8& hits, const Surface8& surface)>;
  /// `samples_lights`: next-event estimation in the media.
  Passage8 pass_media(Path8& paths, M8 lanes, Hit8& hits, Passing8& passing, std::uint32_t bounce, bool samples_lights,
                      const AddEmission& add_emission);
  Path8 camera_paths(std::size_t pixel, U8 seed) const;
  Path8 meter_paths(std::size_t pixel, U8 seed) const;
  Surface8 meter_surface(const Path8& paths, M8 lanes) const;
  /// Over which textures are averaged. `before`: length of the way to the origin of `hits`.
  F8 footprint(const Path8& in, const Hit8& hits, const Surface8& surface, F8 before, std::uint32_t bounce) const;
  /// Russian roulette: returns the lanes that survive, with probability min(1, boost · throughput). It divides their
  /// throughput by this probability.
  M8 roulette(Path8& paths, M8 lanes, std::uint32_t bounce) const;

  const CompiledScene& scene_;
  const FilmChannels& channels_;
  const PixelRect& tile_;
  const SamplePlan& plan_;
  const CompiledMeter* const meter_;
  const std::uint32_t max_bounces_;
  const std::uint32_t pixels_;
  const std::uint32_t slots_;

 private:
  template <class Bsdf, class Weight>
  void sample_light(const Vertex8& vertex, const Bsdf& bsdf, const V8& wo, M8 lanes, const Weight& weight,
                    std::uint32_t draw) {
    const Path8& in = vertex.in;
    V8 origin = vertex.surface.point + vertex.facing * vertex.surface.offset;
    const LightSample8 light = draw_light(origin, opaque_normal(bsdf, vertex.facing), in, vertex.bounce, draw);
    const F8 side = dot(light.wi, vertex.facing);
    V8 contribution;
    M8 valid = lanes & light.valid;
    if (scene_.features().normal_maps) {
      valid = sum_images(vertex, bsdf, wo, light, weight, valid, contribution);
    } else {
      const V8 wi = vertex.frame.to_local(light.wi);
      valid = valid & scatters_to<Bsdf>(wi, side);
      if (valid.any()) {
        contribution = scattered(in, bsdf, wo, wi, light, weight, valid);
      }
    }
    if (valid.none()) {
      return;
    }
    if constexpr (Bsdf::kLosesSamples) {
      valid = and_not(valid, max_component(contribution) <= F8(0.0f));
    }
    if constexpr (Bsdf::kTransmits) {
      origin = vertex.surface.point + vertex.facing * copysign(vertex.surface.offset, side);
      const Media8 media = select(side < F8(0.0f), vertex.crossing.beyond, in.media);
      push_shadows(valid, origin, light, contribution, in.slot, media);
    } else {
      push_shadows(valid, origin, light, contribution, in.slot, in.media);
    }
  }

  /// Light of sampled points that surfaces scatter along the paths.
  template <class Bsdf, class Weight>
  static V8 scattered(const Path8& in, const Bsdf& bsdf, const V8& wo, const V8& wi, const LightSample8& light,
                      const Weight& weight, M8 lanes) {
    return in.throughput * bsdf.eval(wo, wi) * light.weight * weight(light, wi, lanes);
  }
  /// Adds this for all images of the points' directions. Returns the lanes that scatter. Not inlined, so that scenes
  /// without normal maps run short code.
  template <class Bsdf, class Weight>
  [[gnu::noinline]] static M8 sum_images(const Vertex8& vertex, const Bsdf& bsdf, const V8& wo,
                                         const LightSample8& light, const Weight& weight, M8 lanes, V8& sum) {
    M8 all;
    vertex.for_each_wi<Bsdf>(light.wi, lanes, [&](const V8& wi, M8 there) {
      sum = sum + masked(there, scattered(vertex.in, bsdf, wo, wi, light, weight, there));
      all = all | there;
    });
    return all;
  }

  template <class ChannelOf>
  void add_to_planes(M8 lanes, U8 slot, const V8& value, const ChannelOf& channel_of);
  void add_not_finite(M8 lanes, U8 slot);
  /// A segment between boundaries.
  struct Segment8 {
    V8 origin;
    F8 length;
    U8 medium;
    std::uint32_t bounce, passed;
    bool samples_lights;
  };
  /// A point of each path where next-event estimation finds the light that a medium scatters.
  struct Inscattered8 {
    struct Point8 {
      F8 distance;
      V8 throughput;
      F8 density_ratio;  ///< as in Passage8
    };
    M8 lanes;
    F8 total;  ///< throughput that all segments so far scatter
    V8 point, throughput;
    F8 density_ratio;
    U8 medium;
    Media8 media;
  };
  M8 sample_distance(Path8& paths, M8 lanes, const Segment8& segment, F8& scattered_at, F8& density_ratio,
                     Inscattered8& inscattered) const;
  [[gnu::noinline]] F8 choose_apart(const Path8& paths, M8 lanes, const Segment8& segment, const V8& share,
                                    const V8& extinction, const V8& scattered, F8 distance,
                                    Inscattered8& inscattered) const;
  static void keep(const Path8& paths, M8 lanes, const Segment8& segment, const Inscattered8::Point8& point, F8 total,
                   Inscattered8& inscattered);
  void add_inscattered(const Path8& paths, const Inscattered8& inscattered, std::uint32_t bounce);
  V8 shadow_transmittance(const Shadow8& shadows, M8 lanes, M8 blocked);

  WavefrontWorkspace& ws_;
};

}  // namespace lightmill::tracer
