// `preview`: reflectance plus emission of the first surface, without light transport. The environment is the
// background.
//
// Parameters
//   brute-force       rays test every triangle
//
// Weaknesses
//   - Nothing shades a surface, so the picture shows outlines but no shapes.
//   - Mirrors, metal and glass show a colour, without reflections and refractions.
//
// Example
//   lightmill render scenes/cornell-bench-balls.json --method preview --spp 16 -o balls.exr
#include "common/methods/factories.h"

#include "common/methods/camera_method.h"

namespace lightmill {
namespace {

struct PreviewShader {
  const CompiledScene* scene;

  V8 shade(const CameraHit8& at, RenderCounters& /*counters*/) const {
    const MaterialTable& materials = scene->materials();
    const M8 hit = at.arrival.hits.hit;
    const V8& direction = at.arrival.rays.direction;
    const F8 cosine = abs(dot(direction, at.surface.geometric_normal));
    V8 value = masked(hit, materials.albedo(at.surface, hit)) +
               materials.emission(at.surface, cosine, materials.emits(at.surface, hit));
    if (scene->features().shadow_catchers) {
      const M8 shadow_catcher = materials.is_kind(at.surface.material, MaterialKind::shadow_catcher, hit);
      value = select(shadow_catcher, scene->lights().environment.radiance(direction), value);
    }
    if (scene->features().environment) {
      value = select(hit, value, scene->lights().environment.radiance(direction));
    }
    return value + at.arrival.emission;
  }
};

}  // namespace

std::unique_ptr<Method> make_preview_method(ScenePointer scene, const MethodSettings& settings) {
  const PreviewShader shader{scene.get()};
  return make_camera_method(std::move(scene), settings, shader);
}

}  // namespace lightmill
