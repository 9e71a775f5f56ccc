// Densities of lights and BSDFs that the weights of vertex connection and merging need.
#pragma once

#include "common/lights/photon_emission.h"
#include "common/methods/surface_bsdf.h"
#include "common/methods/vcm/weights.h"

namespace lightmill::vcm {

/// Densities of the lights with these numbers. Light leaves `point` along the unit vector `direction` to `from`.
/// `point` is ignored for distant lights. `cosine`: of the direction to the light's surface.
inline LightDensities8 light_densities(const CompiledScene& scene, const PhotonEmission& emission, U8 light,
                                       const V8& from, const V8& point, const V8& direction, F8 cosine, M8 lanes) {
  const LightTable& lights = scene.lights();
  const auto below = [&](LightKind kind) { return lanes & signed_less(light, U8(lights.first(kind))); };
  const M8 near = below(LightKind::directional), known = below(LightKind::environment);
  const M8 intersectable = lights.are_intersectable(light, known);
  const M8 surfaces = below(LightKind::point) | (intersectable & near);
  const M8 points = and_not(near, surfaces), suns = and_not(and_not(known, near), intersectable);
  const M8 sky = and_not(and_not(lanes, known) | intersectable, near);
  const F8 distance2 = length_squared(point - from);
  LightDensities8 out{F8(0.0f), F8(0.0f), select(surfaces, cosine, F8(1.0f)), points | suns};
  out.emission = emission.pdf(light, select(near, point, from), direction, cosine, lanes);
  if (surfaces.any()) {
    out.drawn = lights.pdf_solid_angle(from, light, sqrt(distance2), cosine, surfaces);
  }
  if (out.delta.any()) {
    const F8 choice = lights.choice_pmf(from, light, out.delta);
    out.drawn = select(points, choice * distance2, select(suns, choice, out.drawn));
  }
  if (sky.any()) {
    out.drawn = select(sky, lights.distant_pdf_solid_angle(from, light, -direction, sky), out.drawn);
  }
  return out;
}

inline V8 flipped(M8 lanes, const V8& v) {
  return {v.x, v.y, select(lanes, -v.z, v.z)};
}

/// Density per solid angle of sampling `wo` given `wi`. Both directions are in the local frame of a ray from `wo`. For
/// transmitted light, this is the density of the BSDF on the other side.
template <class Bsdf>
F8 reverse_pdf(const CompiledScene& scene, const Surface8& surface, const Crossing8& crossing, const Bsdf& bsdf,
               const V8& wo, const V8& wi, M8 lanes) {
  if constexpr (!Bsdf::kTransmits) {
    return masked(wi.z > F8(0.0f), bsdf.pdf_solid_angle(wi, wo));
  } else if constexpr (std::is_same_v<Bsdf, DiffuseTransmission8>) {
    const M8 through = wi.z < F8(0.0f);
    return bsdf.pdf_solid_angle(flipped(through, wi), flipped(through, wo));
  } else {
    const M8 through = wi.z < F8(0.0f);
    const F8 ahead = relative_index(scene, surface, crossing, lanes);
    const F8 eta = select(through, F8(1.0f) / ahead, ahead);
    const V8 from = flipped(through, wi), to = flipped(through, wo);
    if constexpr (std::is_same_v<Bsdf, RoughDielectric8>) {
      return RoughDielectric8{eta, bsdf.alpha}.pdf_solid_angle(from, to);
    } else {
      static_assert(std::is_same_v<Bsdf, Principled8>);
      const M8 front = and_not(surface.front, through) | and_not(through, surface.front);
      return Principled8(scene.materials().principled(surface, lanes), eta, from, front).pdf_solid_angle(from, to);
    }
  }
}

}  // namespace lightmill::vcm
