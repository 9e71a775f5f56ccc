// What photons are aimed at.
#pragma once

#include <span>
#include <vector>

#include "common/math/vec.h"

namespace lightmill {

/// Of an infinite radius: all that is there.
struct BoundingSphere {
  Vec3d center{0};
  double radius = 0;
};

/// A plane without end.
struct BoundlessPlane {
  Vec3d point{0};
  Vec3d normal{0, 1, 0};  ///< unit
};

/// Aiming takes time in proportion to their number.
inline constexpr std::size_t kMostPhotonTargets = 32;

/// At most `most` spheres (at least 2) that together hold all of these; a function of the spheres and their order
/// alone. Infinite ones become one, the last. Where the finite ones are too many, what lies near each other shares a
/// sphere: the largest group is halved, at the median of its longest side, until there are enough groups.
std::vector<BoundingSphere> group_targets(std::span<const BoundingSphere> targets, std::size_t most);

}  // namespace lightmill
