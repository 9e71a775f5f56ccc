// `raycast`: direct light of all lights at the first surface (local_shading.h), plus its emission.
//
// Only the position in the pixel and on the lens is random.
//
// Parameters
//   flat              surfaces are shaded with their geometric normals
//   brute-force       rays test every triangle
//
// Weaknesses
//   - Light is not followed further. Mirrors, and smooth metal and glass, are black.
//   - All shadows are hard. Emissive objects act as points.
//   - The environment lights all surfaces evenly.
//
// Example
//   lightmill render scenes/cornell-bench-balls.json --method raycast:flat --spp 16 -o balls.exr
#include "common/methods/factories.h"

#include "common/methods/camera_method.h"
#include "common/methods/raycast/local_shading.h"

namespace lightmill {
namespace {

struct RaycastShader {
  LocalShading shading;

  V8 shade(const CameraHit8& at, RenderCounters& counters) const {
    const Arrival8& arrival = at.arrival;
    const M8 hit = arrival.hits.hit;
    V8 light = shading.background(arrival.rays.direction, and_not(at.lanes, hit));
    if (hit.any()) {
      const LitVertex8 vertex = shading.vertex(arrival, at.surface);
      light = light + shading.emission(vertex, hit) + shading.scattered(vertex, hit, counters);
    }
    return light * arrival.transmittance + arrival.emission;
  }
};

}  // namespace

std::unique_ptr<Method> make_raycast_method(ScenePointer scene, const MethodSettings& settings,
                                            const MethodSpec& spec) {
  const RaycastShader shader{LocalShading(*scene, spec.flat)};
  return make_camera_method(std::move(scene), settings, shader, spec.flat);
}

}  // namespace lightmill
