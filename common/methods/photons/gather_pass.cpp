#include "common/methods/photons/gather_pass.h"

#include "common/methods/photons/photon_tracer.h"

namespace lightmill::photons {

void GatherPass::trace(const CompiledScene& scene, const PhotonSource& source, RenderCounters& counters,
                       const std::stop_token& stop) {
  PhotonPaths paths{plan.kind.caustic};
  PhotonTracer(scene, source, paths, *this, counters).run(stop);
}

void GatherPass::index(const CompiledScene& scene) {
  std::vector<std::uint32_t> of_first, of_later;
  const bool all = !plan.kind.caustic;
  double sum = 0;
  for (std::uint32_t i = 0; i < photons.size(); ++i) {
    (all || photons[i].first != 0 ? of_first : of_later).push_back(i);
    const double distance = glm::length(photons[i].point - scene.camera().position);
    sum += all ? 1 / (distance + 1e-30) : distance;
  }
  // Global photons reach far out on infinite planes. The harmonic mean keeps the radii near the camera small.
  const auto count = static_cast<double>(photons.size());
  const double mean = all ? count / sum : sum / count;
  const auto typical = std::max(static_cast<float>(plan.radius_per_length * mean), 0x1p-60f);
  least = typical / 4;
  most = typical * 4;
  first = PhotonMap(photons, of_first, 2 * typical);
  later = PhotonMap(photons, of_later, 2 * kLaterRadius * typical);
}

}  // namespace lightmill::photons
