// Triangulation of polygons.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace lightmill {

/// Cuts a polygon into triangles of its own corners, with its orientation. Appends them to `triangles` as indices into
/// `corners`: at least three, with finite coordinates. Takes a fan from the first corner if it covers the polygon. Else
/// cuts ears off (Meisters 1975) in the plane of Newell's normal, in at most 2,000 steps for each corner. Corners may
/// touch, as where two coincident edges join a hole to the outside. False if there was no ear left, as where the
/// outline crosses itself, or no time. Then the rest is a fan, and covers too much.
bool triangulate(std::span<const std::array<double, 3>> corners, std::vector<std::array<std::uint32_t, 3>>& triangles);

}  // namespace lightmill
