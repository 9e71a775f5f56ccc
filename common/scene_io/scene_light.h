// Light in a loaded scene: whether there is any, and whether it lights the scene.
#pragma once

#include "common/scene_io/load.h"

namespace lightmill {

/// Whether any light, or material of an object, emits light.
bool emits_light(const Scene& scene);

/// Whether something lights the scene: a light, or emissive surfaces that light the others, not only a display or a
/// label. The mean irradiance of the other surfaces must be at least 1 % of that under a white sky of radiance 1. It is
/// estimated from 256 points on the emitters and 256 on the surfaces, without shadows. Emissive textures do not
/// count, because most of such a texture is black. Black surfaces are not lit. If there are no others, any emission
/// counts. All shapes must be meshes. Takes time in proportion to their triangles.
bool is_lit(const LoadedScene& loaded);

}  // namespace lightmill
