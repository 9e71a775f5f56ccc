// The BSDFs that have a density and are not Lambert's: the templates of scattering.h for each.
#include "common/base/check.h"
#include "common/materials/holdout.h"
#include "common/methods/path/scattering.h"

namespace lightmill::path {

void Batch::shade_glossy(MaterialKind kind, const Vertex8& vertex, M8 lanes) {
  const MaterialTable& materials = scene_.materials();
  switch (kind) {
    case MaterialKind::phong:
      shade_scattering(vertex, materials.phong(vertex.surface, lanes), lanes);
      return;
    case MaterialKind::rough_conductor:
      shade_scattering(vertex, materials.conductor(vertex.surface, lanes), lanes);
      return;
    case MaterialKind::rough_dielectric:
      shade_scattering(vertex, RoughDielectric8{relative_index(vertex, lanes), materials.alpha(vertex.surface, lanes)},
                       lanes);
      return;
    case MaterialKind::principled: {
      const V8 wo = vertex.frame.to_local(-vertex.in.direction);
      const Principled8 bsdf(materials.principled(vertex.surface, lanes), relative_index(vertex, lanes), wo,
                             vertex.surface.front);
      shade_scattering(vertex, bsdf, lanes);
      return;
    }
    case MaterialKind::holdout:
      shade_holdout(vertex, lanes);
      return;
    default:
      LM_CHECK(false, "not a glossy kind: {}", static_cast<int>(kind));
  }
}

/// Its shading normal is the geometric one: light and what it is compared with come over the same horizon.
void Batch::shade_holdout(const Vertex8& vertex, M8 lanes) {
  const Path8& in = vertex.in;
  const V8 background = scene_.lights().environment.radiance(in.direction);
  const V8 unoccluded = scene_.unoccluded_irradiance(vertex.surface.point, vertex.facing, lanes);
  const auto unlit = [](F8 irradiance, F8 radiance) { return select(irradiance > F8(0.0f), F8(0.0f), radiance); };
  const V8 shown{unlit(unoccluded.x, background.x), unlit(unoccluded.y, background.y),
                 unlit(unoccluded.z, background.z)};
  if ((max_component(shown) > F8(0.0f)).any()) {  // where no light could come, there is no shadow
    add_background(in, lanes, shown, vertex.bounce);
  }
  const Vertex8 flat{in, vertex.surface, vertex.facing, Frame8(vertex.facing), vertex.bounce, vertex.crossing};
  shade_scattering(flat, Holdout8::showing(background, unoccluded), lanes);
}

}  // namespace lightmill::path
