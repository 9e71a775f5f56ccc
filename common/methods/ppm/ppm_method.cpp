// `ppm`: progressive photon mapping (Knaus and Zwicker 2011, "Progressive Photon Mapping: A Probabilistic Approach").
//
// Photons bring all light that receivers get, direct light included. Receivers are surfaces, and points in media that
// scatter. Camera paths follow casters, and the delta lobes of receivers, to the first receiver. There a density estimate gathers photons within a radius that shrinks from pass
// to pass. One sample takes one photon pass.
//
// The picture depends on next-event estimation only at rough casters and shadow catchers, so `ppm` checks the other
// methods.
//
// Parameters
//   photons=N         photons per pass (default: one for 16 pixels of the film, from 4096 to 65536)
//   radius=C          gather radius in the first pass, in pixels (default 3, and 1/20 of the distance at most)
//   no-absorption     media absorb nothing
//   brute-force       rays test every triangle
//   --max-bounces N   scatterings of a path, at most (default 1000)
//
// Weaknesses
//   - Edges and small shadows are blurred, more than by any other method.
//   - The error falls slowly, as samples^(-2/3).
//
// Example
//   lightmill render scenes/cornell-bench-balls.json --method ppm --spp 256 -o balls.exr
#include "common/methods/factories.h"

#include "common/methods/photons/gathering.h"

namespace lightmill {
namespace {

class PpmEstimator : public photons::GatherEstimator {
 public:
  using GatherEstimator::GatherEstimator;
  static constexpr bool kPhotonsReachMeters = true;
  static constexpr bool kSamplesLightsInMedia = false;

  template <class Tracer, class Bsdf>
  void scatter(Tracer& tracer, const Vertex& vertex, const Bsdf& bsdf, const V8& wo, M8 lanes) {
    // Photons.
    gather(tracer, vertex, bsdf, wo, lanes);
    // Next-event estimation: at casters, which store no photons, and at shadow catchers, which compare irradiance from
    // lights only.
    if constexpr (requires { Bsdf::kEndsPaths; }) {
      sample_lights(tracer, vertex, bsdf, wo, lanes);
    } else {
      sample_lights(tracer, vertex, bsdf, wo, lanes & vertex.at.casters);
    }
    // BSDF sampling: the path ends at the first receiver, unless a delta lobe continues it.
    tracer.sample_bsdf(vertex, bsdf, wo, lanes, [&](const BsdfSample8& sample, Path& out, M8 there) {
      return scatter_delta(vertex, sample, out, there);
    });
  }

  // The path ends in the medium.
  template <class Tracer>
  void scatter_in_medium(Tracer& tracer, const Path& in, const tracer::Passage8& passage, M8 lanes,
                         std::uint32_t bounce) {
    gather_in_media(tracer, in, passage, lanes, bounce);
  }

  static M8 scatter_delta(const Vertex& vertex, const BsdfSample8& sample, Path& out, M8 lanes) {
    extend(vertex, sample, out);
    return lanes & ((out.chain == U8(photons::kFromCamera)) | ~continues(out));
  }

  template <class Tracer>
  void finish_sample(Tracer& tracer) {
    if (tracer.meter() != nullptr) {
      photons::finish_meter(tracer, *pass_, ws_.meter_columns);
    }
  }
};

}  // namespace

std::unique_ptr<Method> make_ppm_method(ScenePointer scene, const MethodSettings& settings, const MethodSpec& spec) {
  return photons::make_photon_method<PpmEstimator>(std::move(scene), settings, spec, photons::kGlobalPhotons);
}

}  // namespace lightmill
