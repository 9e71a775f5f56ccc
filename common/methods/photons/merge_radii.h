// How near light paths and paths from the eye count as in one place.
#pragma once

#include <algorithm>

#include "common/math/transcendental.h"
#include "common/math/vec.h"

namespace lightmill::photons {

/// Within a radius that grows with the distance from the eye, between limits. All lengths are the frame's.
struct MergeRadii {
  Vec3 eye{0};
  float per_length = 0, least = 0, most = 0;
  F8 at(const V8& p) const {
    return min(max(sqrt(length_squared(p - broadcast(eye))) * F8(per_length), F8(least)), F8(most));
  }
  float at(const Vec3& p) const { return std::clamp(glm::length(p - eye) * per_length, least, most); }
  /// The merging factor η of this many light paths.
  F8 factor(const V8& p, std::uint32_t light_paths) const {
    const F8 radius = at(p);
    return radius * radius * F8(kPi * static_cast<float>(light_paths));
  }
};

}  // namespace lightmill::photons
