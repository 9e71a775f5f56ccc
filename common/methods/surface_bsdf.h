// Dispatch from a material's kind to its BSDF of eight lanes.
#pragma once

#include "common/base/check.h"
#include "common/materials/dielectric.h"
#include "common/materials/diffuse.h"
#include "common/materials/mirror.h"
#include "common/scene/compiled/compiled_scene.h"

namespace lightmill {

/// Smooth metal: a delta BSDF.
struct SmoothConductor8 {
  Conductor8 metal;
  BsdfSample8 sample(const V8& wo) const { return metal.sample(wo, {}, F8(0.0f)); }
};

/// Shadow catcher. It is no BSDF, because it scatters by more than its surface.
struct ShadowCatcherSurface {};

/// Index of refraction behind a boundary, relative to the ray's side. `crossing` is used only in scenes with media.
inline F8 relative_index(const CompiledScene& scene, const Surface8& surface, const Crossing8& crossing, M8 lanes) {
  if (scene.features().media) {
    return crossing.eta;
  }
  const F8 ior = scene.materials().ior(surface, lanes);
  return select(surface.front, ior, F8(1.0f) / ior);
}

/// Calls `visit(bsdf, lanes)` for surfaces of one kind, seen from `wo` in the local frame. BSDFs with a density follow
/// common/materials/bsdf.h. Delta BSDFs have `sample(wo)` (smooth glass: `sample(wo, u)`) and no `eval`. Diffuse lanes
/// that scatter nothing are omitted.
template <class Visit>
void visit_bsdf(const CompiledScene& scene, MaterialKind kind, const Surface8& surface, const Crossing8& crossing,
                const V8& wo, M8 lanes, Visit&& visit) {
  const MaterialTable& materials = scene.materials();
  switch (kind) {
    case MaterialKind::diffuse: {
      const Diffuse8 bsdf{materials.reflectance(surface, lanes)};
      lanes = lanes & (max_component(bsdf.reflectance) > F8(0.0f));
      if (lanes.any()) {
        visit(bsdf, lanes);
      }
      return;
    }
    case MaterialKind::rough_diffuse: {
      const RoughDiffuse8 bsdf = materials.rough_diffuse(surface, lanes);
      lanes = lanes & (max_component(bsdf.reflectance) > F8(0.0f));
      if (lanes.any()) {
        visit(bsdf, lanes);
      }
      return;
    }
    case MaterialKind::diffuse_transmission: {
      const DiffuseTransmission8 bsdf = materials.diffuse_transmission(surface, lanes);
      lanes = lanes & (max_component(bsdf.reflectance + bsdf.transmittance) > F8(0.0f));
      if (lanes.any()) {
        visit(bsdf, lanes);
      }
      return;
    }
    case MaterialKind::mirror:
      visit(Mirror8{materials.reflectance(surface, lanes)}, lanes);
      return;
    case MaterialKind::dielectric:
      visit(Dielectric8{relative_index(scene, surface, crossing, lanes)}, lanes);
      return;
    case MaterialKind::conductor:
      visit(SmoothConductor8{materials.conductor(surface, lanes)}, lanes);
      return;
    case MaterialKind::phong:
      visit(materials.phong(surface, lanes), lanes);
      return;
    case MaterialKind::rough_conductor:
      visit(materials.conductor(surface, lanes), lanes);
      return;
    case MaterialKind::rough_dielectric:
      visit(materials.dielectric(surface, relative_index(scene, surface, crossing, lanes), lanes), lanes);
      return;
    case MaterialKind::principled:
      visit(Principled8(materials.principled(surface, lanes), relative_index(scene, surface, crossing, lanes), wo,
                        surface.front),
            lanes);
      return;
    case MaterialKind::shadow_catcher:
      visit(ShadowCatcherSurface{}, lanes);
      return;
    case MaterialKind::mixture:
      break;
  }
  LM_CHECK(false, "unknown kind of material");
}

/// Calls `shade(kind, lanes)` for each material kind of the surfaces, in a fixed order.
template <class Shade>
void for_each_kind(const MaterialTable& materials, const Surface8& surface, M8 lanes, const Shade& shade) {
  if (const auto only = materials.only_kind()) {
    shade(*only, lanes);
    return;
  }
  for (const MaterialKind kind : materials.kinds()) {
    const M8 of_kind = materials.is_kind(surface.material, kind, lanes);
    if (of_kind.any()) {
      shade(kind, of_kind);
    }
  }
}

}  // namespace lightmill
