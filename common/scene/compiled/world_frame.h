// The frame in which a scene is rendered: recentred, and rescaled if it is very large or small.
#pragma once

#include <limits>

#include "common/math/vec.h"

namespace lightmill {

struct Bounds {
  Vec3d low{std::numeric_limits<double>::infinity()};
  Vec3d high{-std::numeric_limits<double>::infinity()};
  void add(const Vec3d& p) {
    low = glm::min(low, p);
    high = glm::max(high, p);
  }
  bool empty() const { return !(low.x <= high.x); }
  Vec3d size() const { return high - low; }
};

/// The frame's origin is the centre of the scene, so that floats hold only differences. Very large or small scenes are
/// scaled by a power of two, so that squares of areas neither underflow nor overflow. This scale changes no bit of the
/// results.
class WorldFrame {
 public:
  WorldFrame() = default;
  explicit WorldFrame(const Bounds& bounds);

  /// From scene units to the frame.
  Vec3d to_frame(const Vec3d& p) const { return (p - center_) * scale_; }
  double scale() const { return scale_; }
  /// Diagonal of the bounds, in scene units.
  double extent() const { return extent_; }
  /// Intensity is power per solid angle. If distances are scaled by s, it is scaled by s².
  Vec3 scaled_intensity(const Vec3& intensity) const;

 private:
  Vec3d center_{0};
  double extent_ = 0;
  double scale_ = 1;
};

}  // namespace lightmill
