// `caustic`: path tracing, with photons for caustics.
//
// The method splits light transport by how a path starts at its light:
//   - from the light via casters to a receiver, which is another surface or a point in a medium that scatters: photons
//     trace these paths, to their end
//   - all other paths: `path` traces them, from the camera
// Casters are mirrors, smooth glass and smooth metal (MaterialTable::casters). In Heckbert's notation the photons bring
// L S+ D (D|S)* E. Only the materials along a path decide who traces it, so no light is counted twice or missed.
//
// A photon at a directly visible receiver adds to the pixels that see it. This part is unbiased. The camera may also
// see a receiver via casters. There a density estimate gathers photons within a radius that shrinks from pass to pass
// (Jensen 1996, "Global Illumination using Photon Maps"; Knaus and Zwicker 2011, "Progressive Photon Mapping: A
// Probabilistic Approach"). In media the photons are in a ball. One sample takes one photon pass.
//
// Parameters
//   photons=N         photons per pass (default: one for 16 pixels of the film, from 4096 to 65536)
//   radius=C          gather radius in the first pass, in pixels (default 1.5, and 1/20 of the distance at most)
//   no-absorption     media absorb nothing
//   brute-force       rays test every triangle
//   --max-bounces N   scatterings of a path, at most (default 1000)
//
// Weaknesses
//   - Surfaces and media that the camera sees via casters are blurred while the radius is large.
//   - Photons do not cover caustics of glossy surfaces, or of coats over diffuse surfaces. `path` has to find them.
//
// Example
//   lightmill render scenes/cornell-bench-balls.json --method caustic --spp 256 -o balls.exr
#include "common/methods/factories.h"

#include "common/methods/photons/gathering.h"

namespace lightmill {
namespace {

class CausticEstimator : public photons::GatherEstimator {
 public:
  using GatherEstimator::GatherEstimator;

  template <class Tracer, class Bsdf>
  void scatter(Tracer& tracer, const Vertex& vertex, const Bsdf& bsdf, const V8& wo, M8 lanes) {
    // Photons: gathered at the first receiver that the camera sees via casters. finish_sample splats photons that it
    // sees directly.
    if (vertex.bounce > 0 || tracer.meter() != nullptr) {
      gather(tracer, vertex, bsdf, wo, lanes);
    }
    // Next-event estimation: not at casters that follow a receiver. Photons bring the light that goes from casters to
    // receivers.
    sample_lights(tracer, vertex, bsdf, wo,
                  lanes & ((vertex.path.chain == U8(photons::kFromCamera)) | ~vertex.at.casters));
    // BSDF sampling.
    tracer.sample_bsdf(vertex, bsdf, wo, lanes, [&](const BsdfSample8& sample, Path& out, M8 there) {
      extend(vertex, sample, out);
      return there;
    });
  }

  template <class Tracer>
  void scatter_in_medium(Tracer& tracer, Path in, const tracer::Passage8& passage, M8 lanes, std::uint32_t bounce) {
    const F8 length = path_length(in, passage);
    const bool from_camera = bounce == 0 && tracer.meter() == nullptr;
    gather_in_media(tracer, in, passage, from_camera ? lanes & (length < F8(pass_->near)) : lanes, bounce);
    in.path_length = length;
    in.chain = U8(photons::kFromReceiver);
    PathEstimator::scatter_in_medium(tracer, in, passage, lanes, bounce);
  }

  static M8 scatter_delta(const Vertex& vertex, const BsdfSample8& sample, Path& out, M8 lanes) {
    extend(vertex, sample, out);
    return lanes;
  }

  template <class Tracer>
  void finish_sample(Tracer& tracer) {
    if (tracer.meter() != nullptr) {
      photons::finish_meter(tracer, *pass_, ws_.meter_columns);
      return;
    }
    photons::add_visible_photons(
        tracer, *pass_, ws_.splats, ws_.counters,
        [&](const photons::VisibleSplat8& splat, const auto& /*bsdf*/, const V8& /*wo*/, const V8& /*wi*/, M8 lanes,
            const V8& value) { tracer.add_photons(lanes, splat.pixel, value, splat.photon.group); });
    photons::for_each_visible_scatter(scene_, *pass_, tracer.tile(), ws_.splats, ws_.counters,
                                      [&](const photons::VisibleScatter8& seen) {
                                        tracer.add_photons(seen.lanes, seen.pixel, seen.value, seen.photon.group);
                                      });
  }
};

}  // namespace

std::unique_ptr<Method> make_caustic_method(ScenePointer scene, const MethodSettings& settings,
                                            const MethodSpec& spec) {
  return photons::make_photon_method<CausticEstimator>(std::move(scene), settings, spec, photons::kCausticPhotons);
}

}  // namespace lightmill
