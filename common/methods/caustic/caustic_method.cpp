// Path tracing with photons for caustics.
//
// Splits light transport by how a path starts at its light. Paths that meet casters first (mirrors, smooth glass and
// metal: MaterialTable::casters) and then another surface, a receiver, are traced from the light, to their end: these
// are the photons. `path` finds all others. In Heckbert's notation the photons bring L S+ D (D|S)* E. Only the
// materials of a path's surfaces decide, so no light is counted twice or missed.
//
// A photon adds to the pixels that see its receiver directly, without bias. Where the receiver is first seen over
// casters, a density estimate gathers photons within a radius that shrinks from pass to pass (Jensen 1996; Knaus and
// Zwicker 2011). One sample is one pass of photons.
//
// Parameters: photons=N a pass; radius=C of the first pass, in pixels; no-absorption; --max-bounces.
// Weaknesses: blur of what is seen over casters, while the radius is large. Scattering media. Caustics of glossy
// surfaces and of coats over diffuse ones, which `path` is left to find. Example: lightmill render
// scenes/cornell-bench-balls.json --method caustic --spp 256 -o balls.exr
#include "common/methods/factories.h"

#include "common/methods/photons/gathering.h"

namespace lightmill {
namespace {

class CausticEstimator : public photons::GatherEstimator {
 public:
  using GatherEstimator::GatherEstimator;

  template <class Tracer, class Bsdf>
  void scatter(Tracer& tracer, const Vertex& vertex, const Bsdf& bsdf, const V8& wo, M8 lanes) {
    // Photons: at receivers that are first seen over casters. Those seen directly are splatted (finish_sample).
    if (vertex.bounce > 0 || tracer.meter() != nullptr) {
      gather(tracer, vertex, bsdf, wo, lanes);
    }
    // Next-event estimation: not at casters that a receiver is seen over. Such light starts over casters.
    sample_lights(tracer, vertex, bsdf, wo,
                  lanes & ((vertex.path.chain == U8(photons::kFromCamera)) | ~vertex.at.casters));
    // BSDF sampling.
    tracer.sample_bsdf(vertex, bsdf, wo, lanes, [&](const BsdfSample8& sample, Path& out, M8 there) {
      extend(vertex, sample, out);
      return there;
    });
  }

  static M8 scatter_delta(const Vertex& vertex, const BsdfSample8& sample, Path& out, M8 lanes) {
    extend(vertex, sample, out);
    return lanes;
  }

  template <class Tracer>
  void finish_sample(Tracer& tracer) {
    if (tracer.meter() != nullptr) {
      photons::add_meter_hits(tracer, *pass_);
      return;
    }
    photons::add_seen_photons(
        tracer, *pass_, ws_.splats, ws_.counters,
        [&](const photons::SeenSplat8& splat, const auto& /*bsdf*/, const V8& /*wo*/, const Frame8& /*frame*/, M8 lanes,
            const V8& value) { tracer.add_photons(lanes, splat.pixel, value, splat.photon.group); });
  }
};

}  // namespace

std::unique_ptr<Method> make_caustic_method(ScenePointer scene, const MethodSettings& settings,
                                            const MethodSpec& spec) {
  return photons::make_photon_method<CausticEstimator>(std::move(scene), settings, spec, photons::PhotonKind::caustic);
}

}  // namespace lightmill
