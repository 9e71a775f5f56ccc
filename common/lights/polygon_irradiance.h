// Irradiance from a polygon, in closed form.
#pragma once

#include <span>

#include "common/math/vec.h"

namespace lightmill {

inline constexpr std::size_t kMostPolygonCorners = 64;

/// Irradiance over radiance on a surface with unit normal n, from the part of an even convex polygon above it, without
/// occlusion (Lambert's formula). Corners are relative to the surface's point. Both sides of the polygon shine.
double polygon_irradiance(std::span<const Vec3d> corners, const Vec3d& n);

}  // namespace lightmill
