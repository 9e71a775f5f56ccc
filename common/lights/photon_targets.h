// Photon targets: spheres at which photons are aimed.
#pragma once

#include <span>
#include <vector>

#include "common/math/vec.h"

namespace lightmill {

/// An infinite radius stands for the whole scene.
struct BoundingSphere {
  Vec3d center{0};
  double radius = 0;
};

/// An infinite plane.
struct InfinitePlane {
  Vec3d point{0};
  Vec3d normal{0, 1, 0};  ///< unit
};

/// Largest number of targets. The time to aim is proportional to the number.
inline constexpr std::size_t kMaxPhotonTargets = 32;

/// At most `most` spheres (at least 2) that contain all of these. The result depends only on the spheres and their
/// order. Infinite spheres become one, the last. If there are too many finite ones, neighbours share a sphere. The
/// largest group is halved at the median of its longest side until there are enough groups.
std::vector<BoundingSphere> group_targets(std::span<const BoundingSphere> targets, std::size_t most);

}  // namespace lightmill
