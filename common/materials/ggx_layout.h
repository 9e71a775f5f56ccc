// Layout of the tables of ggx_albedo.h, which ggx_tabulate.cpp prints.
#pragma once

#include "common/math/vec.h"

namespace lightmill::ggx {

inline constexpr int kAngles = 33;              ///< nodes of √cos θ or `direction_coordinate`
inline constexpr int kRoughnesses = 33;         ///< nodes of √alpha in [0, 1]
inline constexpr int kIndices = 81;             ///< nodes of `index_coordinate`
inline constexpr int kGlossIndices = 36;        ///< nodes of `gloss_index_coordinate`
inline constexpr int kCoatIndex = 15;           ///< the one of index 1.5
inline constexpr int kCoats = 17, kBases = 17;  ///< nodes of √alpha of coats, and of facets below them
inline constexpr int kAnisotropies = 9;         ///< nodes of the strength in [0, 1]
inline constexpr int kAzimuths = 9;             ///< nodes of `azimuth_coordinate`

/// In [0, 1]: fine near the horizon, where smooth surfaces lose light, and near the normal, for glass from within.
inline F8 direction_coordinate(F8 cos_theta) {
  const F8 c = min(max(cos_theta, F8(0.0f)), F8(1.0f));
  return F8(0.75f) * sqrt(c) + F8(0.25f) * (F8(1.0f) - sqrt(F8(1.0f) - c * c));
}

/// In [0, 1]: 0 for directions over the x axis, 1 over the y axis.
inline F8 azimuth_coordinate(const V8& w) {
  const F8 x = abs(w.x), y = abs(w.y), sum = x + y;
  return select(sum > F8(0.0f), y / sum, F8(0.0f));
}

inline constexpr float kIndexScale = 0.15f;
/// In [0, 1]: 0.5 for eta = 1, near which it is fine. 1/eta is opposite to eta.
inline F8 index_coordinate(F8 eta) {
  const F8 contrast = (eta - F8(1.0f)) / (eta + F8(1.0f));
  return F8(0.5f) + F8(0.5f * (1 + kIndexScale)) * contrast / (abs(contrast) + F8(kIndexScale));
}

/// In [0, 1] for eta >= 1: fine near 1, where albedos rise fast at grazing angles.
inline F8 gloss_index_coordinate(F8 eta) {
  return index_coordinate(eta) - F8(0.5f) + F8(0.5f) * (eta - F8(1.0f)) / (eta + F8(1.0f));
}

}  // namespace lightmill::ggx
