#include "common/scene/compiled/compiled_scene.h"

namespace lightmill {

F8 CompiledScene::light_pdf_solid_angle(const V8& from, const Hit8& hits, F8 cos_light, M8 lanes) const {
  const F8 pdf_area = gather(emitter_pdf_area_.data(), hits.geometry, lanes);
  F8 pdf = pdf_area * hits.distance * hits.distance / cos_light;
  if (const M8 sphere = geometry_.is_sphere(hits.geometry, lanes); sphere.any()) {
    const V8 center = geometry_.sphere_center(hits.geometry, sphere);
    const F8 radius = geometry_.sphere_radius(hits.geometry, sphere);
    const F8 probability = gather(emitter_probability_.data(), hits.geometry, sphere);
    pdf = select(sphere, probability * sphere_pdf_solid_angle(from, center, radius, hits.distance, cos_light), pdf);
  }
  return pdf;
}

}  // namespace lightmill
