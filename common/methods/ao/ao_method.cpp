// `ao`: ambient occlusion, whatever the material.
//
// The value is the mean visibility over the hemisphere, weighted by the cosine. Visibility is 1 in directions where
// nothing lies within `distance`, else 0. So the picture is that of white diffuse surfaces under a constant sky of
// radiance 1, without interreflection. Camera rays that hit nothing give 1.
//
// Parameters
//   distance=D        how far rays go, in scene units (default: unlimited)
//   brute-force       rays test every triangle
//
// Weaknesses
//   - Materials, lights and the environment do not matter. Mirrors and glass look white.
//   - A closed room is black without a `distance`.
//
// Example
//   lightmill render scenes/cornell-bench-balls.json --method ao:distance=1 --spp 64 -o ao.exr
#include "common/methods/factories.h"

#include "common/methods/camera_method.h"
#include "common/methods/shading_frame.h"
#include "common/sampling/warp.h"

namespace lightmill {
namespace {

struct AoShader {
  const CompiledScene* scene;
  float distance;  ///< in units of the compiled scene's frame; infinite: no limit

  V8 shade(const CameraHit8& at, RenderCounters& counters) const {
    const Surface8& s = at.surface;
    const ShadingFrame8 shading(s);
    const Pair8 u = sobol_pair(U8(at.index), decision_seed(at.pixel_seed, kFirstPathDecision));
    V8 direction = shading.frame.to_world(square_to_cosine_hemisphere(u));
    shading.turn(direction, M8());
    // Where the shading normal leans away from the geometric one, directions below the surface see no sky.
    const M8 above = at.arrival.hits.hit & (dot(direction, shading.facing) > F8(0.0f));
    const Ray8 rays{s.point + shading.facing * s.offset, direction, F8(distance)};
    const F8 open = visibility(above, rays, at, counters);
    const F8 value = select(at.arrival.hits.hit, open, masked(at.lanes, F8(1.0f)));
    return {value, value, value};
  }

  F8 visibility(M8 lanes, const Ray8& rays, const CameraHit8& at, RenderCounters& counters) const {
    if (scene->features().media) {
      const Arrival8 arrival =
          trace_transmittance(*scene, lanes, rays, at.arrival.media, at.passing(*scene, 1), kNoGeometry, counters);
      return masked(and_not(lanes, arrival.hits.hit), F8(1.0f));
    }
    counters.shadow_rays += static_cast<std::uint64_t>(lanes.count());
    const M8 blocked = scene->accel().occluded(lanes, rays);
    return masked(and_not(lanes, blocked), F8(1.0f)) + share_passed(*scene, blocked, rays, counters);
  }
};

}  // namespace

std::unique_ptr<Method> make_ao_method(ScenePointer scene, const MethodSettings& settings, const MethodSpec& spec) {
  const float distance = spec.distance ? static_cast<float>(*spec.distance * scene->frame().scale())
                                       : std::numeric_limits<float>::infinity();
  const AoShader shader{scene.get(), distance};
  return make_camera_method(std::move(scene), settings, shader);
}

}  // namespace lightmill
