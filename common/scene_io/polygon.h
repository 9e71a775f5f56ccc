// Polygons cut into triangles.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace lightmill {

/// Cuts a polygon into triangles of its own corners, with its orientation; they are appended to `triangles` as indices
/// into `corners`. Where a fan from the first corner covers it (as for every convex polygon) the fan is taken; else
/// ears are cut off (Meisters 1975) in the plane that Newell's normal gives, in time O(n · reflex corners) as a rule.
/// Corners may touch, as where a hole is joined to the outside by two edges that lie on each other.
///
/// False if no ear was left to cut, as where the outline crosses itself: the rest is a fan then, and covers too much.
/// There must be at least three corners, with finite coordinates.
bool triangulate(std::span<const std::array<double, 3>> corners, std::vector<std::array<std::uint32_t, 3>>& triangles);

}  // namespace lightmill
