// The BSDFs that have a density and are not Lambert's: the templates of scattering.h for each.
#include "common/base/check.h"
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
    default:
      LM_CHECK(false, "not a glossy kind: {}", static_cast<int>(kind));
  }
}

}  // namespace lightmill::path
