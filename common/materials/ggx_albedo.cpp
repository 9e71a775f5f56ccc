#include "common/materials/ggx_albedo.h"

#include "common/materials/ggx_layout.h"

namespace lightmill::ggx {
namespace {

#include "ggx_tables.inc"

/// The node below `t` in [0, 1], and the distance of t from it.
struct Place8 {
  U8 node;
  F8 rest;
};
Place8 place(F8 t, int nodes) {
  const F8 scaled = min(max(t, F8(0.0f)), F8(1.0f)) * F8(static_cast<float>(nodes - 1));
  const U8 node = truncate(min(scaled, F8(static_cast<float>(nodes) - 1.5f)));
  return {node, scaled - to_float(node)};
}

F8 interpolate(const float* table, const Place8& at) {
  const F8 a = gather(table, at.node, M8(true));
  const F8 b = gather(table, at.node + U8(1u), M8(true));
  return a + (b - a) * at.rest;
}

F8 interpolate(const float* table, const Place8& row, const Place8& column) {
  const U8 width(static_cast<std::uint32_t>(kAngles));
  const U8 first = row.node * width + column.node;
  const F8 below = interpolate(table, {first, column.rest});
  const F8 above = interpolate(table, {first + width, column.rest});
  return below + (above - below) * row.rest;
}

F8 interpolate(const float* table, const Place8& slice, Place8 row, int rows, const Place8& column) {
  const U8 height(static_cast<std::uint32_t>(rows));
  row.node = row.node + slice.node * height;
  const F8 below = interpolate(table, row, column);
  row.node = row.node + height;
  const F8 above = interpolate(table, row, column);
  return below + (above - below) * slice.rest;
}

}  // namespace

Albedo8 albedo(F8 cos_theta, F8 alpha) {
  const Place8 row = place(sqrt(alpha), kRoughnesses);
  const Place8 column = place(sqrt(max(cos_theta, F8(0.0f))), kAngles);
  return {interpolate(kNormal, row, column), interpolate(kGrazing, row, column)};
}

Albedo8 mean_albedo(F8 alpha) {
  const Place8 row = place(sqrt(alpha), kRoughnesses);
  return {interpolate(kMeanNormal, row), interpolate(kMeanGrazing, row)};
}

F8 balance(F8 cos_theta, F8 alpha) {
  return interpolate(kMetal, place(sqrt(alpha), kRoughnesses), place(direction_coordinate(cos_theta), kAngles));
}

F8 balance(F8 cos_theta, F8 alpha, F8 eta) {
  return interpolate(kGlass, place(index_coordinate(eta), kIndices), place(sqrt(alpha), kRoughnesses), kRoughnesses,
                     place(direction_coordinate(cos_theta), kAngles));
}

F8 coat_below(F8 cos_theta, F8 coat_alpha, F8 alpha) {
  return interpolate(kCoat, place(sqrt(coat_alpha), kCoats), place(sqrt(alpha), kBases), kBases,
                     place(direction_coordinate(cos_theta), kAngles));
}

V8 kept_by_bounces(const V8& mean_fresnel, F8 alpha) {
  const F8 e = sqrt(mean_albedo(alpha).of(F8(1.0f), F8(1.0f)));
  const auto kept = [&](F8 f) { return f * e / (F8(1.0f) - f * (F8(1.0f) - e)); };
  return {kept(mean_fresnel.x), kept(mean_fresnel.y), kept(mean_fresnel.z)};
}

}  // namespace lightmill::ggx
