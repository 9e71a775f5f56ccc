#include "common/scene/compiled/world_frame.h"

#include <algorithm>
#include <cmath>

namespace lightmill {

WorldFrame::WorldFrame(const Bounds& bounds) {
  if (bounds.empty()) {
    return;
  }
  center_ = (bounds.low + bounds.high) * 0.5;
  const Vec3d size = bounds.size();
  extent_ = glm::length(size);
  constexpr double kUnscaled = 0x1p20;
  if (const double length = std::hypot(size.x, size.y, size.z);
      length > 0 && (length > kUnscaled || length < 1 / kUnscaled)) {
    scale_ = std::ldexp(1.0, std::min(-std::ilogb(length), 1000));
  }
}

Vec3 WorldFrame::scaled_intensity(const Vec3& intensity) const {
  constexpr double kLimit = 1e36;  // samples with this value are out of range anyway (SampleSums), but finite
  return Vec3(glm::min(Vec3d(intensity) * scale_ * scale_, Vec3d(kLimit)));
}

}  // namespace lightmill
