#include "common/methods/photons/photon_pass.h"

namespace lightmill::photons {
namespace {

/// Adds the media at the point where each light starts, as seen from the camera. So photons are in the media in which
/// camera paths arrive there, even if a shape is open, like a room whose front is a window to its fog. `off`: distance
/// from its centre along its axis, in sizes of the light.
template <class Lights>
void add_media(const CompiledScene& scene, const Lights& lights, double off, PhotonSource& source) {
  for (std::size_t i = 0; i < lights.size(); ++i) {
    const LightBounds b = lights.bounds(i);
    const Vec3d middle = (b.low + b.high) * 0.5;
    const double size = glm::length(b.high - b.low);
    const double rounding = size > 0 ? 1e-5 * glm::length(middle) : 0.0;
    alignas(32) std::uint32_t low[8], high[8];
    const Vec3d start = middle + b.axis * (off * size + rounding), way = Vec3d(scene.camera().position) - start;
    const double distance = glm::length(way);
    const Media8 media = scene.media_at(Vec3(start), Vec3(distance > 0 ? way / distance : b.axis));
    media.low.store(low);
    media.high.store(high);
    source.media_low.push_back(low[0]);
    source.media_high.push_back(high[0]);
  }
}

}  // namespace

PhotonSource photon_source(const CompiledScene& scene, bool caustic) {
  const CausticTargets& scene_targets = scene.caustic_targets();
  const LightTable& lights = scene.lights();
  BoundingSphere everything = scene_targets.scene;
  if (!scene_targets.planes.empty()) {
    everything.radius = std::numeric_limits<double>::infinity();
  }
  const std::span<const BoundingSphere> targets =
      caustic ? std::span(scene_targets.casters) : std::span(&everything, 1);
  PhotonSource source{PhotonEmission(lights, targets, scene_targets.planes, scene_targets.scene, !caustic), {}, {}};
  if (scene.features().media && !source.emission.empty()) {
    constexpr double kOnSphere = 0.57736;  // the diagonal of the box of a unit sphere is 2·√3; half of it, inverted
    add_media(scene, lights.facets, 1e-5, source);
    add_media(scene, lights.spheres, kOnSphere / 2, source);
    add_media(scene, lights.disks, 1e-5, source);
    add_media(scene, lights.points, 0, source);
    add_media(scene, lights.spots, 0, source);
    add_media(scene, lights.cosine_powers, 0, source);
    add_media(scene, lights.ies, 0, source);
    source.media_low.resize(lights.size() + 1, 0);  // an environment that is not sampled follows the lights
    source.media_high.resize(lights.size() + 1, 0);
  }
  return source;
}

}  // namespace lightmill::photons
