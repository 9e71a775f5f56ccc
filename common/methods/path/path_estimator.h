// `path`: path tracing with next-event estimation and multiple importance sampling.
//
// The method solves the light transport equation (Kajiya 1986, "The Rendering Equation"; Pharr, Jakob and Humphreys
// 2016, "Physically Based Rendering", 14.4)
//
//   L(x, ω) = Le(x, ω) + ∫ f(x, ω, ω') L(x', −ω') |cosθ'| dω'
//
// It follows one path per camera ray. Below sample 256 the path splits into two at its first surface. Each vertex
// estimates direct light twice: by a sampled point of a light, and by a sampled direction of the BSDF. The power
// heuristic weights both (Veach 1997, chapter 9). Segments in media that scatter have one such vertex for the light and
// one for the direction (docs/design/core.md, "Fog"). The estimate is unbiased, but for averages of fine textures (the
// same page, "Textures").
//
// Parameters
//   --max-bounces N   scatterings of a path, at most (default 1000)
//   brute-force       rays test every triangle
// The numbers of split paths and Russian roulette are constants (tracer/sample_plan.h). The bits of samples depend on
// them.
//
// Weaknesses
//   - Caustics. Paths rarely hit small lights through mirrors or glass, and never hit lights without extent.
//     `caustic` and `vcm` find this light.
//
// Example
//   lightmill render scenes/cornell-bench-blocks.json --method path --spp 256 -o blocks.exr
#pragma once

#include "common/methods/tracer/estimator.h"
#include "common/methods/tracer/power_heuristic.h"
#include "common/methods/tracer/scattered_directions.h"

namespace lightmill::path {

using tracer::power_heuristic;

class PathEstimator : public tracer::EstimatorBase {
 public:
  using Path = tracer::Path8;
  using Workspace = tracer::PathWorkspace<Path>;
  struct Shared {};

  PathEstimator(const CompiledScene& scene, const Shared& /*shared*/, std::uint64_t /*sample*/, std::uint64_t /*end*/,
                Workspace& /*ws*/)
      : PathEstimator(scene) {}

  // Emission: the path has hit an emitter in the direction that the last BSDF sampled.
  F8 emission_weight(const Path& in, const Hit8& hits, const V8& /*point*/, F8 cosine, std::uint32_t /*bounce*/,
                     M8 lanes) const {
    return bsdf_sampling_weight(in, scene_.light_pdf_solid_angle(in.origin, hits, cosine, lanes));
  }

  // Environment: the path has left the scene.
  F8 environment_weight(const Path& in, std::uint32_t /*bounce*/, M8 lanes) const {
    const U8 sky(scene_.lights().first(LightKind::environment));
    return bsdf_sampling_weight(in, scene_.lights().distant_pdf_solid_angle(in.origin, sky, in.direction, lanes));
  }

  // The path has met an intersectable light.
  F8 light_hit_weight(const Path& in, std::uint32_t light_index, const LightTable::LightHit8& met,
                      std::uint32_t /*bounce*/) const {
    return bsdf_sampling_weight(
        in, scene_.lights().hit_pdf_solid_angle(light_index, in.origin, in.direction, met, met.hit));
  }

  // Surface: next-event estimation and BSDF sampling. The path continues with throughput · f · |cosθ| / p. Russian
  // roulette (Wavefront::roulette) ends paths that carry little light.
  template <class Tracer, class Bsdf>
  static void scatter(Tracer& tracer, const typename Tracer::Vertex& vertex, const Bsdf& bsdf, const V8& wo, M8 lanes) {
    sample_lights(tracer, vertex, bsdf, wo, lanes);
    tracer.sample_bsdf(vertex, bsdf, wo, lanes,
                       [](const BsdfSample8& /*sample*/, const Path& /*out*/, M8 there) { return there; });
  }

  // Next-event estimation: f · Le · V · cosθ / p. p is the density of the sampled point per solid angle. No other
  // technique finds lights without extent, so their weight is 1.
  template <class Bsdf>
  static void sample_lights(tracer::Wavefront& tracer, const tracer::Vertex8& vertex, const Bsdf& bsdf, const V8& wo,
                            M8 lanes) {
    tracer.sample_lights(vertex, bsdf, wo, lanes, [&](const LightSample8& light, const V8& wi, M8 /*valid*/) {
      return select(light.pdf_solid_angle > F8(0.0f),
                    power_heuristic(light.pdf_solid_angle, bsdf.pdf_solid_angle(wo, wi)), F8(1.0f));
    });
  }

  // Medium: the phase function is its own density. Next-event estimation samples points of the segment by a density of
  // its own (Wavefront::add_inscattered). A direction from this point has k times its density per solid angle, where k
  // is the ratio of both densities per length. So the weights of both techniques sum to 1.
  static constexpr bool kScattersInMedia = true;
  template <class Tracer>
  void scatter_in_medium(Tracer& tracer, const typename Tracer::Path& in, const tracer::Passage8& passage, M8 lanes,
                         std::uint32_t bounce) const {
    typename Tracer::Path out = Tracer::unsplit(in, bounce);
    const tracer::ScatteredDirections8 directions(scene_.lights().equiangular(), scene_.media(), passage.medium,
                                                  passage.point, -in.direction);
    out.origin = passage.point;
    out.direction = directions.sample(tracer.decide(out, bounce, tracer::bsdf_decision(bounce)));
    const F8 pdf = directions.pdf_solid_angle(out.direction), weight = directions.phase(out.direction) / pdf;
    out.throughput = out.throughput * weight;
    // The path may pass a light, and become bright again. The limit lets roulette end paths that became dim many times.
    constexpr float kMostScale = 1e6f;
    out.roulette_scale = min(out.roulette_scale / weight, F8(kMostScale));
    out.pdf_solid_angle = pdf / passage.density_ratio;
    tracer.continue_path(out, lanes, bounce);
  }

 protected:
  explicit PathEstimator(const CompiledScene& scene) : scene_(scene) {}

  // Sampled lights do not find what camera rays and delta BSDFs find, so these have weight 1.
  static F8 bsdf_sampling_weight(const Path& in, F8 light_pdf_solid_angle) {
    return select(in.pdf_solid_angle > F8(0.0f), power_heuristic(in.pdf_solid_angle, light_pdf_solid_angle), F8(1.0f));
  }

  const CompiledScene& scene_;
};

}  // namespace lightmill::path
