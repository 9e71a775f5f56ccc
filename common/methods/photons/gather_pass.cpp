#include "common/methods/photons/gather_pass.h"

#include <numeric>

#include "common/methods/photons/photon_tracer.h"

namespace lightmill::photons {
namespace {

/// PhotonPass::near over the mean distance of photons from the camera. A larger one has less noise and more blur.
constexpr double kNear = 0.125;

/// The mean distance of these photons from the camera. Global photons reach far out on infinite planes. The harmonic
/// mean keeps their radii near the camera small.
double mean_distance(std::span<const Photon> photons, const CompiledScene& scene, bool harmonic) {
  double sum = 0;
  for (const Photon& photon : photons) {
    const double distance = glm::length(photon.point - scene.camera().position);
    sum += harmonic ? 1 / (distance + 1e-30) : distance;
  }
  const auto count = static_cast<double>(photons.size());
  return harmonic ? count / sum : sum / count;
}

/// Gather radius at this distance.
float radius_at(double distance, float radius_per_length) {
  return std::max(static_cast<float>(radius_per_length * distance), 0x1p-60f);
}

GatherPass::Radii limits(float typical) {
  return {typical / 4, typical * 4};
}

}  // namespace

void GatherPass::trace(const CompiledScene& scene, const PhotonSource& source, RenderCounters& counters,
                       const std::stop_token& stop) {
  PhotonPaths paths{plan.kind.caustic};
  PhotonTracer(scene, source, paths, *this, counters).run(stop);
}

void GatherPass::index(const CompiledScene& scene) {
  std::vector<std::uint32_t> of_first, of_later, all_scattered(in_media.size());
  const bool all = !plan.kind.caustic;
  for (std::uint32_t i = 0; i < photons.size(); ++i) {
    (all || photons[i].first != 0 ? of_first : of_later).push_back(i);
  }
  std::iota(all_scattered.begin(), all_scattered.end(), 0u);
  if (!photons.empty()) {
    const float typical = radius_at(mean_distance(photons, scene, all), plan.radius_per_length);
    radii = limits(typical);
    first = PhotonMap(photons, of_first, 2 * typical);
    later = PhotonMap(photons, of_later, 2 * kLaterRadius * typical);
  }
  if (!in_media.empty()) {
    const double distance = mean_distance(in_media, scene, all);
    const float typical = radius_at(distance, plan.media_radius_per_length);
    near = plan.kind.gathers_near ? static_cast<float>(kNear * distance) : 0;
    media_radii = limits(typical);
    scattered = PhotonMap(in_media, all_scattered, 2 * typical);
  }
}

}  // namespace lightmill::photons
