// `vcm`: vertex connection and merging, which is bidirectional path tracing and photon mapping in one estimator.
//
// Georgiev, Křivánek, Davidovič and Slusallek 2012, "Light Transport Simulation with Vertex Connection and Merging".
// Each sample has one pass of light paths, shared by all tiles. Each vertex of a camera path
//   - is merged with the light vertices near it,
//   - is connected to all vertices of one light path, drawn at random,
//   - is connected to a sampled point of a light (next-event estimation).
// Each light vertex is connected to the camera. Camera paths also count the emitters that they hit. The balance
// heuristic weights all five techniques (weights.h). Vertices at delta BSDFs are neither merged nor connected.
//
// Parameters
//   photons=N         light paths per pass (default: one for 4 pixels of the film, from 4096 to 65536)
//   radius=C          merging radius in the first pass, in pixels (default 0.5, and 1/20 of the distance at most)
//   no-absorption     media absorb nothing
//   brute-force       rays test every triangle
//   --max-bounces N   scatterings of a path, at most (default 1000)
//
// Weaknesses
//   - It is slower than `path` where `path` does well.
//   - Merged light is blurred while the radius is large.
//   - Closed bright rooms have long light paths, so a pass has few of them.
//   - Scattering media are refused.
//
// Example
//   lightmill render scenes/cornell-bench-balls.json --method vcm --spp 256 -o balls.exr
#include "common/methods/factories.h"

#include "common/methods/photons/gathering.h"
#include "common/methods/vcm/densities.h"
#include "common/methods/vcm/light_path_pass.h"

namespace lightmill::vcm {
namespace {

using photons::Photon8;

struct CameraPayload {
  Partial8 partial;
};
struct CameraPath8 : CameraPayload, tracer::Path8 {
  struct AtVertex {
    Partial8 partial;  ///< as the path arrives
    F8 merging;        ///< the merging factor η
  };
};

/// Eight queued connections: vertices of camera paths, each with the light vertex it connects to.
struct Connection8 {
  V8 origin;  ///< off the surface, on the light vertex's side
  V8 value;   ///< for unit radiance from the light vertex: throughput · f · cosine
  U8 slot;
  U8 photon;     ///< number of the light vertex in the pass
  F8 pdf;        ///< density of this direction by the BSDF, per solid angle
  F8 behind;     ///< vcm::behind of the camera path's vertex
  F8 cosine;     ///< to the geometric normal at the camera path's vertex
  Media8 media;  ///< at the origin
};

struct VcmShared {
  VcmShared(const CompiledScene& scene, const photons::PhotonPassSettings& settings, std::uint32_t at_once)
      : passes(scene, settings), connections_at_once(at_once) {}
  bool empty() const { return passes.empty(); }

  LightPathPasses passes;
  std::uint32_t connections_at_once;
};

struct VcmWorkspace : photons::PhotonWorkspace<CameraPath8> {
  explicit VcmWorkspace(const VcmShared& shared) : PhotonWorkspace(shared) {
    connections.reserve(shared.connections_at_once);
  }
  LaneQueue<Connection8> connections;
};

class VcmEstimator : public tracer::EstimatorBase {
 public:
  using Path = CameraPath8;
  using Vertex = tracer::PathVertex8<Path>;
  using Workspace = VcmWorkspace;
  using Shared = VcmShared;

  /// Light vertices see the texture as it is. With other colours, the weights of a path would not sum to 1.
  static constexpr bool kAveragesTextures = false;

  VcmEstimator(const CompiledScene& scene, const VcmShared& shared, std::uint64_t sample, std::uint64_t end,
               VcmWorkspace& ws)
      : scene_(scene),
        emission_(shared.passes.emission()),
        pass_(shared.passes.pass(sample, end, ws)),
        connections_at_once_(shared.connections_at_once),
        ws_(ws) {}

  // A camera ray starts. Its density is 1 / the pixel's solid angle, because a pixel has one path.
  void start(Path& path) const {
    const CameraBasis& camera = scene_.camera();
    const F8 cosine = dot(path.direction, broadcast(camera.forward));
    const F8 pdf = F8(1.0f / glm::dot(camera.right, camera.right)) / (cosine * cosine * cosine);
    path.partial = camera_start(pdf, light_paths());
  }

  void start_on_meter(const CompiledMeter& meter, Path& /*path*/, Path::AtVertex& at) const {
    at.merging = F8(pass_->plan.meter_area(scene_, meter) * light_paths() / (kTileSize * kTileSize));
  }

  Path::AtVertex arrive(const Path& in, const Surface8& surface, M8 /*lanes*/) const {
    const F8 cosine = max(abs(dot(in.direction, surface.geometric_normal)), F8(1e-8f));
    return {vcm::arrive(in.partial, length_squared(surface.point - in.origin), cosine),
            pass_->merging_factor(surface.point)};
  }

  // Emission. No other technique finds emitters that next-event estimation does not sample, so their weight is 1.
  F8 emission_weight(const Path& in, const Hit8& hits, const V8& point, F8 cosine, std::uint32_t bounce,
                     M8 lanes) const {
    const EmitterTable::Lights8 found = scene_.emitter(hits, lanes);
    return select(found.sampled, found_light_weight(in, found.light, point, cosine, bounce, found.sampled), F8(1.0f));
  }

  // Environment.
  F8 environment_weight(const Path& in, std::uint32_t bounce, M8 lanes) const {
    return found_light_weight(in, U8(scene_.lights().first(LightKind::environment)), in.origin, F8(1.0f), bounce,
                              lanes);
  }

  // The path has met an intersectable light.
  F8 light_hit_weight(const Path& in, std::uint32_t light_index, const LightTable::LightHit8& met,
                      std::uint32_t bounce) const {
    return found_light_weight(in, U8(light_index), met.point, met.cosine, bounce, met.hit);
  }

  template <class Tracer, class Bsdf>
  void scatter(Tracer& tracer, const Vertex& vertex, const Bsdf& bsdf, const V8& wo, M8 lanes) {
    // Merging and connection with light paths. Not at shadow catchers, which compare irradiance from lights only.
    if constexpr (!requires { Bsdf::kEndsPaths; }) {
      if (vertex.bounce > 0 || !tracer.on_irradiance_meter()) {  // no light vertex lies on a meter
        merge(tracer, vertex, bsdf, wo, lanes);
      }
      connect(tracer, vertex, bsdf, wo, lanes);
    }
    // Next-event estimation.
    tracer.sample_lights(vertex, bsdf, wo, lanes, [&](const LightSample8& light, const V8& wi, M8 valid) {
      return sampled_light_weight(vertex, bsdf, wo, wi, light, valid);
    });
    // BSDF sampling.
    tracer.sample_bsdf(vertex, bsdf, wo, lanes, [&](const BsdfSample8& s, Path& out, M8 there) {
      const F8 cosine = cosine_of(vertex, s);
      const F8 back = reverse_pdf(scene_, vertex.surface, vertex.crossing, bsdf, wo, s.wi, lanes);
      out.partial = select(s.pdf_solid_angle > F8(0.0f),
                           vcm::scatter(vertex.at.partial, vertex.at.merging, cosine, s.pdf_solid_angle, back),
                           vcm::scatter_delta(vertex.at.partial, cosine));
      return there;
    });
  }

  static M8 scatter_delta(const Vertex& vertex, const BsdfSample8& sample, Path& out, M8 lanes) {
    out.partial = vcm::scatter_delta(vertex.at.partial, cosine_of(vertex, sample));
    return lanes;
  }

  template <class Tracer>
  void finish_bounce(Tracer& tracer) {
    trace_connections(tracer);
  }

  // Connects light vertices to the camera, or adds the photons that crossed the meter.
  template <class Tracer>
  void finish_sample(Tracer& tracer) {
    if (tracer.meter() != nullptr) {
      photons::finish_meter(tracer, *pass_, ws_.meter_columns);
      return;
    }
    photons::add_visible_photons(tracer, *pass_, ws_.splats, ws_.counters,
                                 [&](const photons::VisibleSplat8& splat, const auto& bsdf, const V8& wo, const V8& wi,
                                     M8 lanes, const V8& value) {
                                   const F8 back = bsdf.pdf_solid_angle(wo, wi);
                                   const F8 light = behind(pass_->partials(splat.number, lanes),
                                                           pass_->merging_factor(splat.surface.point), back);
                                   const F8 weight = splatted(light, splat.film_pdf_area, light_paths());
                                   add_light(tracer, lanes, splat.pixel, splat.photon,
                                             masked(max_component(value) > F8(0.0f), value * weight), 0);
                                 });
  }

 private:
  float light_paths() const { return static_cast<float>(pass_->plan.photons); }

  static F8 cosine_of(const Vertex& vertex, const BsdfSample8& sample) {
    return abs(dot(vertex.frame.to_world(sample.wi), vertex.facing));
  }

  // No other technique finds directly visible light (bounce 0), so its weight is 1.
  F8 found_light_weight(const Path& in, U8 light, const V8& point, F8 cosine, std::uint32_t bounce, M8 lanes) const {
    if (bounce == 0) {
      return F8(1.0f);
    }
    return found_light(in.partial,
                       light_densities(scene_, emission_, light, in.origin, point, -in.direction, cosine, lanes));
  }

  template <class Bsdf>
  F8 sampled_light_weight(const Vertex& vertex, const Bsdf& bsdf, const V8& wo, const V8& wi, const LightSample8& light,
                          M8 lanes) const {
    const V8& from = vertex.surface.point;
    const V8 direction = -light.wi;
    const F8 cosine = emission_.cosine(light.light, light.point, direction, lanes);
    const LightDensities8 densities =
        light_densities(scene_, emission_, light.light, from, light.point, direction, cosine, lanes);
    const F8 back = reverse_pdf(scene_, vertex.surface, vertex.crossing, bsdf, wo, wi, lanes);
    return sampled_light(vertex.at.partial, vertex.at.merging, abs(dot(light.wi, vertex.facing)),
                         bsdf.pdf_solid_angle(wo, wi), back, densities);
  }

  /// Adds the light that a light path brings to a camera path's vertex. Bounce 0: to a directly visible vertex.
  static void add_light(tracer::Wavefront& wavefront, M8 lanes, U8 slot, const Photon8& photon, const V8& value,
                        std::uint32_t bounce) {
    const M8 direct = lanes & (photon.scatterings == U8(1u)) & M8(bounce == 0);
    wavefront.add_light(direct, slot, value, true, photon.group);
    wavefront.add_light(and_not(lanes, direct), slot, value, false, photon.group);
  }

  /// Counts light of these photons for the error of a meter.
  void count_on_meter(const tracer::Wavefront& wavefront, M8 lanes, U8 photons, const V8& value) {
    if (wavefront.meter() != nullptr) {
      ws_.meter_columns.add(*pass_, pass_->photons, lanes, photons, value);
    }
  }

  /// Vertex merging.
  template <class Bsdf>
  void merge(tracer::Wavefront& wavefront, const Vertex& vertex, const Bsdf& bsdf, const V8& wo, M8 lanes) {
    if (pass_->merge_map.empty()) {
      return;
    }
    const F8 radius = pass_->merging.at(vertex.surface.point);
    photons::find_photons(pass_->merge_map, vertex.surface.point, radius, lanes, ws_.found, ws_.counters);
    photons::estimate_density(
        wavefront, photons::GatherDiscs(wavefront, *pass_, ws_.found, radius, vertex), vertex, bsdf, wo, lanes,
        [&](const photons::GatherDiscs::Term8& term, const V8& wi, const V8& value) {
          const F8 back = reverse_pdf(scene_, vertex.surface, vertex.crossing, bsdf, wo, wi, term.valid);
          return value * merged(vertex.at.partial, pass_->partials(term.number, term.valid), vertex.at.merging,
                                bsdf.pdf_solid_angle(wo, wi), back);
        },
        [&](const photons::GatherDiscs::Term8& term, const V8& value) {
          const M8 lit = term.valid & (max_component(value) > F8(0.0f));
          const V8 brought = vertex.in.throughput * value;
          add_light(wavefront, lit, vertex.in.slot, term.photon, brought, vertex.bounce);
          count_on_meter(wavefront, lit, term.number, brought);
        });
  }

  /// Vertex connection: each vertex draws a light path, and queues connections to all its vertices.
  template <class Bsdf>
  void connect(tracer::Wavefront& wavefront, const Vertex& vertex, const Bsdf& bsdf, const V8& wo, M8 lanes) {
    const LightPathPass& pass = *pass_;
    if (pass.photons.empty()) {
      return;
    }
    const Path& in = vertex.path;
    const F8 drawn = hashed_number(in.index, decision_seed(in.pixel_seed, tracer::connection_decision(vertex.bounce)));
    const U8 light_path = truncate(drawn * F8(light_paths()));
    U8 at = gather(pass.path_first.data(), light_path, lanes);
    const U8 end = gather(pass.path_first.data(), light_path + U8(1u), lanes);
    for (M8 active = lanes & signed_less(at, end); active.any(); active = active & signed_less(at, end)) {
      const U8 number = gather(pass.path_photons.data(), at, active);
      at = at + U8(1u);
      const Photon8 photon = photons::load_photons(pass.photons, number, active);
      const V8 way = photon.point - vertex.surface.point;
      const V8 direction = way * (F8(1.0f) / sqrt(length_squared(way)));
      const F8 side = dot(direction, vertex.facing);
      const M8 short_enough = active & signed_less(photon.scatterings, U8(wavefront.max_bounces() - vertex.bounce));
      vertex.template for_each_wi<Bsdf>(direction, short_enough, [&](const V8& wi, M8 there) {
        const V8 value = in.throughput * bsdf.eval(wo, wi);
        const M8 valid = there & (max_component(value) > F8(0.0f));
        if (valid.none()) {
          return;
        }
        const F8 back = reverse_pdf(scene_, vertex.surface, vertex.crossing, bsdf, wo, wi, valid);
        const V8 origin = vertex.surface.point + vertex.facing * copysign(vertex.surface.offset, side);
        const Media8 media = select(side < F8(0.0f), vertex.crossing.beyond, in.media);
        ws_.connections.push(valid, {origin, value, in.slot, number, bsdf.pdf_solid_angle(wo, wi),
                                     behind(vertex.at.partial, vertex.at.merging, back), abs(side), media});
        if (ws_.connections.size() >= static_cast<int>(connections_at_once_)) {
          trace_connections(wavefront);
        }
      });
    }
  }

  /// Adds the queued connections that are not occluded. A photon's power is the flux that it brings to a point, so its
  /// scattered light is radiance per area (Georgiev et al. 2012, eq. 5).
  ///
  /// The queue's capacity changes no bit. However often the queue is emptied, a path's connections are added after the
  /// merges at its vertex and before its shadow ray.
  void trace_connections(tracer::Wavefront& wavefront) {
    for (int i = 0; i < ws_.connections.size(); i += 8) {
      const M8 lanes = first_lanes(ws_.connections.size() - i);
      const Connection8 c = ws_.connections.load(i);
      const Photon8 photon = photons::load_photons(pass_->photons, c.photon, lanes);
      const V8 way = photon.point - c.origin;
      const F8 distance = sqrt(length_squared(way));
      const V8 direction = way * (F8(1.0f) / distance);
      const photons::Connection8 end =
          photons::connect(scene_, lanes, photon, c.origin, direction, distance, c.media, ws_.counters);
      const Arrival8& arrival = end.arrival;
      const Surface8& surface = end.surface;
      const F8 cosine = end.cosine;
      const M8 seen = end.reaches;
      if (seen.none()) {
        continue;
      }
      const ShadingFrame8 frame(surface);
      const V8 wo = frame.wo(-direction);
      const F8 per_area = cosine / (distance * distance) * F8(light_paths());  // powers are shares of all paths
      const V8 value = c.value * arrival.transmittance * photon.power * per_area;
      const F8 merging = pass_->merging_factor(surface.point);
      for_each_kind(scene_.materials(), surface, seen, [&](MaterialKind kind, M8 of_kind) {
        visit_bsdf(scene_, kind, surface, arrival.crossing, wo, of_kind, [&](const auto& bsdf, M8 there) {
          if constexpr (requires { bsdf.eval(wo, wo); }) {
            photons::for_each_scattered(bsdf, wo, frame, photon.wi, there, [&](const V8& wi, M8 lit, const V8& sent) {
              const F8 light = behind(pass_->partials(c.photon, lit), merging, bsdf.pdf_solid_angle(wo, wi));
              const F8 light_pdf = reverse_pdf(scene_, surface, arrival.crossing, bsdf, wo, wi, lit);
              const F8 weight = connected(c.behind, c.pdf, c.cosine, light, light_pdf, cosine, distance * distance);
              const V8 brought = masked(max_component(sent) > F8(0.0f), value * sent * weight);
              wavefront.add_light(lit, c.slot, brought, false, photon.group);
              count_on_meter(wavefront, lit, c.photon, brought);
            });
          }
        });
      });
    }
    ws_.connections.clear();
  }

  const CompiledScene& scene_;
  const PhotonEmission& emission_;
  std::shared_ptr<const LightPathPass> pass_;
  std::uint32_t connections_at_once_;
  VcmWorkspace& ws_;
};

}  // namespace
}  // namespace lightmill::vcm

namespace lightmill {

std::unique_ptr<Method> make_vcm_method(ScenePointer scene, const MethodSettings& settings, const MethodSpec& spec,
                                        std::uint32_t connections_at_once) {
  return photons::make_photon_method<vcm::VcmEstimator>(std::move(scene), settings, spec, vcm::kLightPaths,
                                                        connections_at_once);
}

}  // namespace lightmill
