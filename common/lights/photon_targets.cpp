#include "common/lights/photon_targets.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/base/check.h"

namespace lightmill {
namespace {

/// Consecutive spheres, and the box of their centres.
struct Group {
  std::span<BoundingSphere> members;
  Vec3d low, high;
  BoundingSphere sphere;

  explicit Group(std::span<BoundingSphere> spheres) : members(spheres), low(spheres[0].center), high(low) {
    for (const BoundingSphere& s : members) {
      low = glm::min(low, s.center);
      high = glm::max(high, s.center);
    }
    // A single sphere is its own bound.
    sphere.center = members.size() == 1 ? low : (low + high) * 0.5;
    for (const BoundingSphere& s : members) {
      sphere.radius = std::max(sphere.radius, glm::length(s.center - sphere.center) + s.radius);
    }
  }

  /// The two halves along the longest side of the box.
  std::pair<Group, Group> split() const {
    const Vec3d size = high - low;
    const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    std::stable_sort(members.begin(), members.end(), [axis](const BoundingSphere& a, const BoundingSphere& b) {
      return a.center[axis] < b.center[axis];
    });
    const std::size_t half = members.size() / 2;
    return {Group(members.first(half)), Group(members.subspan(half))};
  }
};

}  // namespace

std::vector<BoundingSphere> group_targets(std::span<const BoundingSphere> targets, std::size_t most) {
  LM_CHECK(most >= 2);
  std::vector<BoundingSphere> finite;
  for (const BoundingSphere& t : targets) {
    if (std::isfinite(t.radius)) {
      finite.push_back(t);
    }
  }
  const bool infinite = finite.size() < targets.size();
  std::vector<Group> groups;
  if (!finite.empty()) {
    groups.emplace_back(finite);
  }
  const std::size_t enough = std::min(most - (infinite ? 1 : 0), finite.size());
  while (groups.size() < enough) {
    // A group of one cannot be halved.
    const auto largest = std::ranges::max_element(
        groups, {}, [](const Group& g) { return g.members.size() == 1 ? -1.0 : g.sphere.radius; });
    const auto [first, second] = largest->split();
    *largest = first;
    groups.push_back(second);
  }
  std::vector<BoundingSphere> out;
  for (const Group& group : groups) {
    out.push_back(group.sphere);
  }
  if (infinite) {
    out.push_back({Vec3d(0), std::numeric_limits<double>::infinity()});
  }
  return out;
}

}  // namespace lightmill
