// The length on a surface over which textures are averaged.
//
// A camera ray stands for a part of a pixel. Colours of textures are averaged over the area in which it arrives, so that
// fine textures far away bring little noise. Where the area is longer in one direction, its shorter side counts, so that
// nothing is blurred by more than a pixel. Roughness, normals and opacity are not averaged, because radiance is far from
// linear in those. Rays that a rough surface has scattered have no such area: averages over their lobes moved light
// between places (0.8 % in one test), and removed less than a tenth of the noise.
#pragma once

#include "common/scene/compiled/compiled_scene.h"

namespace lightmill {

/// Share of a pixel's width.
inline constexpr float kPixelFootprint = 0.5f;
/// The width of the area at `distance` along camera rays.
inline F8 camera_width(const CompiledScene& scene, const V8& direction, F8 distance) {
  const CameraBasis& camera = scene.camera();
  return F8(kPixelFootprint * camera.pixel) * distance * abs(dot(direction, broadcast(camera.forward)));
}

/// At grazing angles, an eighth of the area's length counts, up to twice its width. The samples of a pixel spread along
/// it.
inline F8 texture_footprint(const CompiledScene& scene, const Hit8& hits, const Surface8& surface, const V8& direction,
                            F8 width) {
  const F8 cosine = abs(dot(direction, surface.geometric_normal));
  const F8 longer = min(max(F8(0.125f) / max(cosine, F8(1e-4f)), F8(1.0f)), F8(2.0f));
  return masked(hits.hit, width * longer * scene.coordinates_per_length(hits));
}

}  // namespace lightmill
