#include "common/scene/checks.h"

#include <cmath>

namespace lightmill {

Status check_point(std::string_view path, const Point3d& point) {
  for (const double value : point) {
    // Negated, so that NaN fails too.
    if (!(std::abs(value) <= kMaxCoordinate)) {
      return invalid_argument("{}: coordinates must be finite and at most {}, got ({}, {}, {})", path, kMaxCoordinate,
                              point[0], point[1], point[2]);
    }
  }
  return ok_status();
}

Status check_reflectance(const std::string& path, const RgbColor& color) {
  for (const float value : {color.r, color.g, color.b}) {
    if (!(value >= 0 && value <= 1)) {
      return invalid_argument("{}: each component must be in [0, 1], got ({}, {}, {})", path, color.r, color.g,
                              color.b);
    }
  }
  return ok_status();
}

Status check_power(const std::string& path, const RgbColor& color) {
  constexpr float kLimit = 1e20f;
  for (const float value : {color.r, color.g, color.b}) {
    if (!(value >= 0 && value <= kLimit)) {
      return invalid_argument("{}: each component must be in [0, {}], got ({}, {}, {})", path, kLimit, color.r, color.g,
                              color.b);
    }
  }
  return ok_status();
}

}  // namespace lightmill
