// What the weights of vertex connection and merging must know of a light.
#pragma once

#include "common/lights/photon_emission.h"
#include "common/methods/vcm/weights.h"
#include "common/scene/compiled/compiled_scene.h"

namespace lightmill::vcm {

/// Of the lights with these numbers as they shine from `point` (of those infinitely far anything) to `from`, in unit
/// directions of travel, at this cosine to their surfaces.
inline LightDensities8 light_densities(const CompiledScene& scene, const PhotonEmission& emission, U8 light,
                                       const V8& from, const V8& point, const V8& direction, F8 cosine, M8 lanes) {
  const LightTable& lights = scene.lights();
  const auto below = [&](LightKind kind) { return lanes & signed_less(light, U8(lights.first(kind))); };
  const M8 surfaces = below(LightKind::point), near = below(LightKind::directional),
           known = below(LightKind::environment);
  const M8 points = and_not(near, surfaces), suns = and_not(known, near), sky = and_not(lanes, known);
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
    out.drawn = select(sky, lights.environment_pdf_solid_angle(from, -direction, sky), out.drawn);
  }
  return out;
}

}  // namespace lightmill::vcm
