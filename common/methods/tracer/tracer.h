// Wavefront path tracer: traces the camera paths of one sample of a tile, eight at a time, bounce by bounce.
//
// All hits of a bounce are shaded before the next bounce. The remaining paths are packed in order, so that Embree and
// shading see full lanes. The estimator weights what a path finds (estimator.h). The tracer is compiled once per
// estimator. Contributions are added by bounce, and in a bounce in the order emission, photons, connections, shadow
// rays.
#pragma once

#include "common/materials/shadow_catcher.h"
#include "common/methods/surface_bsdf.h"
#include "common/methods/tracer/estimator.h"
#include "common/methods/tracer/wavefront.h"

namespace lightmill::tracer {

template <class Estimator>
class Tracer : public Wavefront {
 public:
  using Path = typename Estimator::Path;
  using Vertex = PathVertex8<Path>;
  using Workspace = typename Estimator::Workspace;

  Tracer(const CompiledScene& scene, const FilmChannels& channels, const PixelRect& tile, const SamplePlan& plan,
         std::uint32_t max_bounces, Estimator& estimator, Workspace& ws)
      : Wavefront(scene, channels, tile, plan, max_bounces, ws), estimator_(estimator), ws_(ws) {}

  /// Adds the light of the tile's pixels [first, last) to the workspace's radiance.
  void trace(std::size_t first, std::size_t last, const std::vector<std::uint32_t>& seeds) {
    ws_.paths.clear();
    std::uint32_t bounce = 0;
    if (!on_irradiance_meter()) {
      start(first, last, seeds);
    } else if constexpr (!Estimator::kPhotonsReachMeters) {
      start_on_meter(first, last, seeds);
      ++bounce;
    }
    for (; ws_.paths.size() > 0 && !ws_.stop.stop_requested(); ++bounce) {
      ws_.next.clear();
      ws_.shadows.clear();
      for (int i = 0; i < ws_.paths.size(); i += 8) {
        trace_segment(ws_.paths.load(i), first_lanes(ws_.paths.size() - i), bounce);
      }
      ws_.counters.closest_hit_rays += static_cast<std::uint64_t>(ws_.paths.size());
      finish_bounce(bounce);
    }
  }

  /// BSDF sampling: each path continues in a sampled direction, and in several at the first surface. `extend(sample,
  /// out, lanes)` sets the estimator's state of the path, and returns the lanes that continue.
  template <class Bsdf, class Extend>
  void sample_bsdf(const Vertex& vertex, const Bsdf& bsdf, const V8& wo, M8 lanes, const Extend& extend) {
    const Path& in = vertex.path;
    const std::uint32_t splits = vertex.bounce == 0 ? plan_.splits : 1;
    for (std::uint32_t split = 0; split < splits; ++split) {
      Path out = in;
      if (vertex.bounce == 0) {  // from here on, each split path has its own point in every sequence
        out.index = U8(plan_.split_index + split);
      }
      const BsdfSample8 sample =
          draw_direction(bsdf, wo, out.index, in.pixel_seed, vertex.bounce, plan_.sobol_vertices);
      out.slot = in.slot + U8(split * pixels_);
      out.throughput = in.throughput * sample.weight * F8(1.0f / static_cast<float>(splits));
      out.roulette_scale = in.roulette_scale * F8(static_cast<float>(splits));
      if constexpr (requires { Bsdf::kEndsPaths; }) {
        out.roulette_scale = F8(kEndedScale);
      }
      M8 there = extend(sample, out, lanes);
      if constexpr (Bsdf::kLosesSamples) {
        there = and_not(there, max_component(sample.weight) <= F8(0.0f));
      }
      spawn(vertex, sample, out, there);
    }
  }

  /// Russian roulette; then queues the survivors.
  [[gnu::always_inline]] void continue_path(Path& out, M8 lanes, std::uint32_t bounce) {
    lanes = roulette(out, lanes, bounce);
    if (lanes.any()) {
      ws_.next.push(lanes, out);
    }
  }

  /// A path that does not split at its first vertex. It keeps the sample's points, with other scrambles.
  static Path unsplit(const Path& in, std::uint32_t bounce) {
    Path out = in;
    if (bounce == 0) {
      out.pixel_seed = mix(in.pixel_seed ^ U8(kUnsplitSalt));
    }
    return out;
  }

 private:
  void start(std::size_t first, std::size_t last, const std::vector<std::uint32_t>& seeds) {
    for (std::size_t pixel = first; pixel < last; pixel += 8) {
      Path path;
      const U8 seed = U8::load(&seeds[pixel]);
      if (meter_ != nullptr) {
        static_cast<Path8&>(path) = meter_paths(pixel, seed);
      } else {
        static_cast<Path8&>(path) = camera_paths(pixel, seed);
        estimator_.start(path);
      }
      ws_.paths.push(first_lanes(static_cast<int>(last - pixel)), path);
    }
  }

  /// Starts the paths of an irradiance meter, scattered from its surface.
  void start_on_meter(std::size_t first, std::size_t last, const std::vector<std::uint32_t>& seeds) {
    ws_.next.clear();
    ws_.shadows.clear();
    const V8 normal = broadcast(meter_->direction);
    for (std::size_t pixel = first; pixel < last; pixel += 8) {
      const M8 lanes = first_lanes(static_cast<int>(last - pixel));
      Path path;
      static_cast<Path8&>(path) = meter_paths(pixel, U8::load(&seeds[pixel]));
      const Surface8 surface = meter_surface(path, lanes);
      Vertex vertex{{ShadingFrame8(normal), path, surface, 0, straight_.crossing}, path};
      estimator_.start_on_meter(*meter_, path, vertex.at);
      scatter(vertex, Diffuse8{broadcast(Vec3(1))}, vertex.frame.to_local(normal), lanes);
    }
    finish_bounce(0);
  }

  void finish_bounce(std::uint32_t bounce) {
    estimator_.finish_bounce(*this);
    trace_shadows(bounce);
    std::swap(ws_.paths, ws_.next);
  }

  void trace_segment(const Path& in, M8 lanes, std::uint32_t bounce) {
    const Ray8 rays{in.origin, in.direction, F8(std::numeric_limits<float>::infinity())};
    add_untraceable(lanes, rays, in.slot);
    if (!scene_.lights().intersectable().empty()) {
      add_intersectable_lights(in, lanes, bounce);
    }
    const Hit8 hits = scene_.accel().intersect(lanes, rays, bounce == 0);
    if (scene_.features().opacity || scene_.features().media) {
      pass_and_shade(in, lanes, rays, hits, bounce);
    } else {
      shade(in, lanes, hits, bounce, in.origin, straight_);
    }
  }

  /// Moves paths through surfaces that may let them pass, and through media, and shades what they reach. Not inlined,
  /// so that scenes without these run short code.
  [[gnu::noinline]] void pass_and_shade(const Path& in, M8 lanes, const Ray8& rays, Hit8 hits, std::uint32_t bounce) {
    Passing8 passing;
    if (scene_.features().opacity) {
      passing = Passing8::decided_by(decide(in, bounce, opacity_decision(bounce)).u);
      hits = pass_surfaces(scene_, lanes, rays, hits, passing, ws_.counters);
    }
    if (!scene_.features().media) {
      shade(in, lanes, hits, bounce, in.origin, straight_);
      return;
    }
    Path there = in;
    const auto add = [&](const Hit8& passed, const Surface8& surface) { add_emission(there, passed, surface, bounce); };
    const Passage8 passage =
        pass_media(there, lanes, hits, passing, bounce, Estimator::kSamplesLightsInMedia, std::cref(add));
    if constexpr (Estimator::kScattersInMedia) {
      if (passage.scattered.any() && bounce < max_bounces_) {
        estimator_.scatter_in_medium(*this, there, passage, passage.scattered & continues(in), bounce);
      }
    }
    shade(there, and_not(lanes, passage.scattered), hits, bounce, passage.origin, passage);
  }

  /// `origin`: of the last segment.
  void shade(const Path& in, M8 lanes, const Hit8& hits, std::uint32_t bounce, const V8& origin,
             const Passage8& passage) {
    if (scene_.features().environment) {
      add_environment(in, and_not(lanes, hits.hit), bounce);
    }
    if (hits.hit.none()) {
      return;
    }
    std::optional<F8> part;
    if (scene_.features().mixtures) {
      part = decide(in, bounce, mixture_decision(bounce)).u;
    }
    Surface8 surface = scene_.surface({origin, in.direction, F8(0.0f)}, hits, part);
    if constexpr (Estimator::kAveragesTextures) {
      if (scene_.features().footprints) {
        surface.footprint = footprint(in, hits, surface, passage.before, bounce);
      }
    }
    if (bounce == 0 && meter_ == nullptr && channels_.shows_surfaces()) {
      store_surfaces(channels_, scene_, hits, surface, in.slot,
                     {ws_.radiance.data(), slots_, ws_.first.empty() ? nullptr : ws_.first.data(), pixels_});
    }
    if (scene_.features().emissive_surfaces) {
      Hit8 from_start = hits;
      from_start.distance = hits.distance + passage.before;
      add_emission(in, from_start, surface, bounce);
    }
    if (bounce == max_bounces_) {
      return;
    }
    M8 shaded = hits.hit;
    if (scene_.features().shadow_catchers) {
      shaded = shaded & continues(in);
      if (shaded.none()) {
        return;
      }
    }
    const Vertex vertex{
        {ShadingFrame8(surface), in, surface, bounce, passage.crossing}, in, estimator_.arrive(in, surface, shaded)};
    for_each_kind(scene_.materials(), surface, shaded,
                  [&](MaterialKind kind, M8 of_kind) { shade_kind(kind, vertex, of_kind); });
  }

  /// Adds the emission of surfaces that paths hit.
  void add_emission(const Path& in, const Hit8& hits, const Surface8& surface, std::uint32_t bounce) {
    M8 emitting = scene_.materials().emits(surface, hits.hit);
    if constexpr (requires { estimator_.found_by_photons(in); }) {
      emitting = and_not(emitting, scene_.emitter(hits, emitting).sampled & estimator_.found_by_photons(in));
    }
    if (emitting.none()) {
      return;
    }
    const F8 cosine = abs(dot(in.direction, surface.geometric_normal));
    const F8 weight = estimator_.emission_weight(in, hits, surface.point, cosine, bounce, emitting);
    const V8 light = in.throughput * scene_.materials().emission(surface, cosine, emitting) * weight;
    const U8 group = channels_.separates_lights() ? scene_.materials().light_group(surface, emitting) : U8(0u);
    add_light(emitting, in.slot, light, bounce <= 1, group);
  }

  /// Adds the radiance of intersectable lights that paths meet. Not inlined, for the same reason.
  [[gnu::noinline]] void add_intersectable_lights(const Path& in, M8 lanes, std::uint32_t bounce) {
    const bool from_camera = bounce == 0 && meter_ == nullptr;
    for (const std::uint32_t light_index : scene_.lights().intersectable()) {
      if (!from_camera || !scene_.lights().is_hidden_from_camera(light_index)) {
        add_intersectable_light(in, light_index, lanes, bounce);
      }
    }
  }

  void add_intersectable_light(const Path& in, std::uint32_t light_index, M8 lanes, std::uint32_t bounce) {
    if constexpr (requires { estimator_.found_by_photons(in); }) {
      lanes = and_not(lanes, estimator_.found_by_photons(in));
    }
    const LightTable::LightHit8 met = scene_.lights().meet(light_index, in.origin, in.direction, lanes);
    if (met.hit.none()) {
      return;
    }
    const V8 light = in.throughput * met.radiance * estimator_.light_hit_weight(in, light_index, met, bounce);
    add_unoccluded(in, met.hit, light_index, met.point, light, bounce);
  }

  /// Adds the environment's light for paths that left the scene.
  void add_environment(const Path& in, M8 escaped, std::uint32_t bounce) {
    if constexpr (requires { estimator_.found_by_photons(in); }) {
      if (scene_.lights().environment.samplable()) {
        escaped = and_not(escaped, estimator_.found_by_photons(in));
      }
    }
    if (escaped.none()) {
      return;
    }
    const F8 weight = estimator_.environment_weight(in, bounce, escaped);
    add_background(in, escaped, scene_.lights().environment.radiance(in.direction) * weight, bounce);
  }

  /// Not inlined, so that meters and surfaces share one copy.
  template <class Bsdf>
  [[gnu::noinline]] void scatter(const Vertex& vertex, const Bsdf& bsdf, const V8& wo, M8 lanes) {
    estimator_.scatter(*this, vertex, bsdf, wo, lanes);
  }

  void shade_kind(MaterialKind kind, const Vertex& vertex, M8 lanes) {
    const V8 wo = vertex.wo(-vertex.in.direction);
    visit_bsdf(scene_, kind, vertex.surface, vertex.crossing, wo, lanes, [&](const auto& bsdf, M8 visible) {
      using Bsdf = std::remove_cvref_t<decltype(bsdf)>;
      if constexpr (std::is_same_v<Bsdf, ShadowCatcherSurface>) {
        shade_shadow_catcher(vertex, visible);
      } else if constexpr (requires { bsdf.eval(wo, wo); }) {
        scatter(vertex, bsdf, wo, visible);
      } else {
        Path out = unsplit(vertex.path, vertex.bounce);
        if constexpr (requires { bsdf.sample(wo); }) {
          continue_specular(vertex, bsdf.sample(wo), out, visible);
        } else {
          const F8 u = decide(out, vertex.bounce, bsdf_decision(vertex.bounce)).u;
          continue_specular(vertex, bsdf.sample(wo, u), out, visible);
        }
      }
    });
  }

  /// Shading uses the geometric normal, so that actual and unoccluded light come over the same horizon.
  void shade_shadow_catcher(const Vertex& vertex, M8 lanes) {
    const V8 background = scene_.lights().environment.radiance(vertex.in.direction);
    const V8 unoccluded = scene_.unoccluded_irradiance(vertex.surface.point, vertex.facing, lanes);
    const auto unlit = [](F8 irradiance, F8 radiance) { return select(irradiance > F8(0.0f), F8(0.0f), radiance); };
    const V8 shown{unlit(unoccluded.x, background.x), unlit(unoccluded.y, background.y),
                   unlit(unoccluded.z, background.z)};
    if ((max_component(shown) > F8(0.0f)).any()) {  // no light can arrive, so there is no shadow
      add_background(vertex.in, lanes, shown, vertex.bounce);
    }
    const Vertex flat{{ShadingFrame8(vertex.facing), vertex.in, vertex.surface, vertex.bounce, vertex.crossing},
                      vertex.path};
    scatter(flat, ShadowCatcher8::showing(background, unoccluded), flat.wo(-vertex.in.direction), lanes);
  }

  void continue_specular(const Vertex& vertex, const BsdfSample8& sample, Path& out, M8 lanes) {
    out.throughput = out.throughput * sample.weight;
    lanes = estimator_.scatter_delta(vertex, sample, out, lanes);
    spawn(vertex, sample, out, lanes);
  }

  /// Sets the ray of a sampled direction. A sample ends if both normals disagree on its side of the surface.
  [[gnu::always_inline]] void spawn(const Vertex& vertex, const BsdfSample8& sample, Path& out, M8 lanes) {
    const F8 offset = vertex.surface.offset;
    out.direction = vertex.frame.to_world(sample.wi);
    out.origin = vertex.surface.point + vertex.facing * select(sample.transmitted, -offset, offset);
    out.pdf_solid_angle = sample.pdf_solid_angle;
    out.roulette_scale = out.roulette_scale * (sample.eta * sample.eta);
    if (scene_.features().media) {
      out.media = select(sample.transmitted, vertex.crossing.beyond, out.media);
    }
    const M8 wrong = vertex.turn(out.direction, sample.transmitted);
    continue_path(out, and_not(lanes, wrong), vertex.bounce);
  }

  Estimator& estimator_;
  Workspace& ws_;
  const Passage8 straight_ = {};  ///< through no boundary
};

}  // namespace lightmill::tracer
