// Irradiance from a sphere, in closed form.
#pragma once

#include "common/math/vec.h"

namespace lightmill {

/// Irradiance over radiance on a surface with unit normal n, from an even sphere whose centre is at `to_center`, without
/// occlusion. It holds also where the sphere cuts the horizon (Snyder, "Area light sources for real-time graphics",
/// 1996). The surface must be outside.
double sphere_irradiance(const Vec3d& to_center, double radius, const Vec3d& n);

}  // namespace lightmill
