// Layout of the tables of sheen.h, which sheen_tabulate.cpp prints.
#pragma once

#include "common/materials/sheen.h"

namespace lightmill::sheen {

inline constexpr int kAngles = 33;       ///< nodes of √cos θ
inline constexpr int kRoughnesses = 33;  ///< nodes from kMinRoughness to 1

/// In [0, 1].
inline F8 roughness_coordinate(F8 roughness) {
  return (roughness - F8(kMinRoughness)) * F8(1 / (1 - kMinRoughness));
}

}  // namespace lightmill::sheen
