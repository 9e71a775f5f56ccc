// Triangulation of polygons.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace lightmill {

/// Cuts a polygon into triangles of its own corners, with its orientation. They are appended to `triangles` as indices
/// into `corners`. If a fan from the first corner covers it (as for every convex polygon), the fan is taken. Else ears
/// are cut off (Meisters 1975) in the plane of Newell's normal. Corners may touch, as where two coincident edges join a
/// hole to the outside. The time is limited to 2,000 steps for each corner.
///
/// False if there was no ear left, as where the outline crosses itself, or no time. Then the rest is a fan, and covers
/// too much. There must be at least three corners, with finite coordinates.
bool triangulate(std::span<const std::array<double, 3>> corners, std::vector<std::array<std::uint32_t, 3>>& triangles);

}  // namespace lightmill
