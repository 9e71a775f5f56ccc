// The length on a surface over which textures are averaged.
//
// A path stands for its neighbours: camera rays for a part of a pixel, scattered rays for a part of the BSDF's lobe.
// Colours of textures are averaged over the area in which these neighbours arrive, so that fine textures far away bring
// little noise. Only colours are: a surface's radiance is linear in them, so the picture's mean stays, but for a blur
// below a pixel. Roughness, normals and opacity are not averaged, because radiance is not linear in those.
#pragma once

#include "common/scene/compiled/compiled_scene.h"

namespace lightmill {

/// Share of a pixel's width.
inline constexpr float kPixelFootprint = 0.5f;
/// Share of the width of the cone 1/pdf around a scattered direction.
inline constexpr float kLobeFootprint = 0.125f;

/// The width of the area at `distance` along camera rays.
inline F8 camera_width(const CompiledScene& scene, const V8& direction, F8 distance) {
  const CameraBasis& camera = scene.camera();
  return F8(kPixelFootprint * camera.pixel) * distance * abs(dot(direction, broadcast(camera.forward)));
}

/// The same for rays that were scattered with this density per solid angle.
inline F8 lobe_width(F8 pdf_solid_angle, F8 distance) {
  return F8(kLobeFootprint) * distance / sqrt(pdf_solid_angle);
}

/// Where rays of this width arrive at an angle, they meet a long area. Its length counts for an eighth at most: the
/// samples of a pixel spread along it.
inline F8 texture_footprint(const CompiledScene& scene, const Hit8& hits, const Surface8& surface, const V8& direction,
                            F8 width) {
  const F8 cosine = abs(dot(direction, surface.geometric_normal));
  const F8 longer = max(F8(1.0f), F8(0.125f) / max(cosine, F8(1e-4f)));
  return masked(hits.hit, width * longer * scene.coordinates_per_length(hits));
}

}  // namespace lightmill
