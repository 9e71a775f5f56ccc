// Light in a loaded scene: whether there is any, and whether it lights the scene.
#pragma once

#include "common/scene_io/load.h"

namespace lightmill {

/// Whether any light, or material of an object, emits light.
bool emits_light(const Scene& scene);

/// Whether something lights the scene: a light, or emissive surfaces that light the others. Emissive details, such as
/// displays and labels, do not suffice.
/// - The mean irradiance of the other surfaces must be at least 1 % of that under a uniform white sky of radiance 1. It
///   is estimated from 256 points on the emitters and 256 points on the surfaces, without shadows, so a surface on the
///   outside of a convex body receives nothing from another one.
/// - Emissive textures do not count, because most of such a texture is black.
/// - Black surfaces are not lit. If there are no others, any emission counts.
/// Takes time in proportion to the triangles of the scene's meshes. All shapes must be meshes.
bool is_lit(const LoadedScene& loaded);

}  // namespace lightmill
