#include "common/scene/validate/parts.h"

#include <cmath>

#include "common/base/text.h"
#include "common/film/layers.h"

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

Status check_direction(std::string_view path, const Point3d& direction) {
  LM_RETURN_IF_ERROR(check_point(path, direction));
  if (!(std::hypot(direction[0], direction[1], direction[2]) > 0)) {
    return invalid_argument("{}: must not be zero", path);
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

Status check_exponent(const std::string& path, double exponent) {
  if (!(exponent >= 0 && exponent <= kMaxCosineExponent)) {
    return invalid_argument("{}: must be in [0, {}], got {}", path, kMaxCosineExponent, exponent);
  }
  return ok_status();
}

Status check_group(const std::string& path, const std::string& group) {
  return group.empty() || is_light_group_name(group)
             ? ok_status()
             : invalid_argument(
                   "{}: at most {} letters, digits, '-' and '_' are possible, and not \"rest\"; got \"{}\"", path,
                   kMaxLightGroupName, printable(group));
}

}  // namespace lightmill
