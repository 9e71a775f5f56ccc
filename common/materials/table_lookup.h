// Linear interpolation in tables, eight lanes at a time.
#pragma once

#include "common/math/simd.h"

namespace lightmill {

/// The node below `t` in [0, 1], and the distance of t from it.
struct Place8 {
  U8 node;
  F8 rest;
};
inline Place8 place(F8 t, int nodes) {
  const F8 scaled = min(max(t, F8(0.0f)), F8(1.0f)) * F8(static_cast<float>(nodes - 1));
  const U8 node = truncate(min(scaled, F8(static_cast<float>(nodes) - 1.5f)));
  return {node, scaled - to_float(node)};
}

inline F8 interpolate(const float* table, const Place8& at) {
  const F8 a = gather(table, at.node, M8(true));
  const F8 b = gather(table, at.node + U8(1u), M8(true));
  return a + (b - a) * at.rest;
}

inline F8 interpolate(const float* table, const Place8& row, const Place8& column, int columns) {
  const U8 width(static_cast<std::uint32_t>(columns));
  const U8 first = row.node * width + column.node;
  const F8 below = interpolate(table, {first, column.rest});
  const F8 above = interpolate(table, {first + width, column.rest});
  return below + (above - below) * row.rest;
}

}  // namespace lightmill
