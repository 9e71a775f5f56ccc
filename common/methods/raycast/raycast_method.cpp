#include "common/methods/raycast/raycast_method.h"

#include "common/methods/camera_method.h"
#include "common/methods/raycast/local_shading.h"

namespace lightmill {
namespace {

struct RaycastShader {
  const CompiledScene* scene;
  LocalShading shading;

  V8 shade(const CameraHit8& at, RenderCounters& counters) const {
    if (!scene->features().media) {
      return arrive(at.lanes, {at.hits, at.rays, {}, {}, broadcast(Vec3(1))}, at.surface, counters);
    }
    const Arrival8 arrival = travel(*scene, at.lanes, at.rays, scene->eye_media(), kNoGeometry, counters);
    return arrive(at.lanes, arrival, scene->surface(arrival.rays, arrival.hits), counters) * arrival.transmittance;
  }

  V8 arrive(M8 lanes, const Arrival8& arrival, const Surface8& surface, RenderCounters& counters) const {
    const M8 hit = arrival.hits.hit;
    const V8 background = shading.background(arrival.rays.direction, and_not(lanes, hit));
    if (hit.none()) {
      return background;
    }
    const LitVertex8 vertex = shading.vertex(arrival, surface);
    return background + shading.emission(vertex, hit) + shading.scattered(vertex, hit, counters);
  }
};

}  // namespace

std::unique_ptr<Method> make_raycast_method(std::shared_ptr<const CompiledScene> scene, const MethodSettings& settings,
                                            const MethodSpec& spec) {
  const RaycastShader shader{scene.get(), LocalShading(*scene, spec.flat)};
  return make_camera_method(std::move(scene), settings, shader, spec.flat);
}

}  // namespace lightmill
