#include "common/methods/preview/preview_method.h"

#include "common/methods/camera_method.h"

namespace lightmill {
namespace {

struct PreviewShader {
  const CompiledScene* scene;

  V8 shade(const CameraHit8& at, RenderCounters& /*counters*/) const {
    const MaterialTable& materials = scene->materials();
    const F8 cosine = abs(dot(at.rays.direction, at.surface.geometric_normal));
    V8 value = masked(at.hits.hit, materials.albedo(at.surface, at.hits.hit)) +
               materials.emission(at.surface, cosine, materials.emits(at.surface, at.hits.hit));
    if (scene->features().holdouts) {
      const M8 holdout = materials.is_kind(at.surface.material, MaterialKind::holdout, at.hits.hit);
      value = select(holdout, scene->lights().environment.radiance(at.rays.direction), value);
    }
    return scene->features().environment
               ? select(at.hits.hit, value, scene->lights().environment.radiance(at.rays.direction))
               : value;
  }
};

}  // namespace

std::unique_ptr<Method> make_preview_method(std::shared_ptr<const CompiledScene> scene,
                                            const MethodSettings& settings) {
  const PreviewShader shader{scene.get()};
  return make_camera_method(std::move(scene), settings, shader);
}

}  // namespace lightmill
