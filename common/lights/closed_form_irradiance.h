// Irradiance from spheres and polygons, in closed form.
#pragma once

#include <span>

#include "common/math/vec.h"

namespace lightmill {

/// Irradiance over radiance on a surface with unit normal n, from a sphere of uniform radiance with its centre at
/// `to_center`, without occlusion. It holds also where the sphere cuts the horizon (Snyder, "Area light sources for
/// real-time graphics", 1996). The surface must be outside.
double sphere_irradiance(const Vec3d& to_center, double radius, const Vec3d& n);

inline constexpr std::size_t kMaxPolygonCorners = 64;

/// Irradiance over radiance on a surface with unit normal n, from the part above it of a convex polygon of uniform
/// radiance, without occlusion (Lambert's formula). Corners are relative to the surface's point. Both sides of the
/// polygon emit.
double polygon_irradiance(std::span<const Vec3d> corners, const Vec3d& n);

}  // namespace lightmill
