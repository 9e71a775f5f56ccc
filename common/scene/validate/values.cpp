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
  if (!(length(direction) > 0)) {
    return invalid_argument("{}: must not be zero", path);
  }
  return ok_status();
}

Status check_range(const std::string& path, double value, double low, double high) {
  return value >= low && value <= high ? ok_status()
                                       : invalid_argument("{}: must be in [{}, {}], got {}", path, low, high, value);
}

Status check_components(const std::string& path, const RgbColor& color, double limit) {
  for (const float value : {color.r, color.g, color.b}) {
    if (!(value >= 0 && value <= static_cast<float>(limit))) {
      return invalid_argument("{}: each component must be in [0, {}], got ({}, {}, {})", path, limit, color.r, color.g,
                              color.b);
    }
  }
  return ok_status();
}

Status check_reflectance(const std::string& path, const RgbColor& color) {
  return check_components(path, color, 1);
}

Status check_power(const std::string& path, const RgbColor& color) {
  return check_components(path, color, kMaxPower);
}

bool are_parallel(const Point3d& a, const Point3d& b) {
  return !(length(cross(a, b)) > 1e-6 * length(a) * length(b));
}

Status check_name_length(const std::string& path, const std::string& name) {
  return name.size() <= kMaxSceneNameBytes ? ok_status()
                                           : invalid_argument("{}.name: {} bytes are more than the limit of {}", path,
                                                              name.size(), kMaxSceneNameBytes);
}

Status check_new_name(std::set<std::string_view>& names, const std::string& path, const std::string& name,
                      std::string_view what) {
  return names.insert(name).second ? ok_status()
                                   : invalid_argument("{}.name: \"{}\" names an earlier {} already", path, name, what);
}

Status check_group(const std::string& path, const std::string& group) {
  return group.empty() || is_light_group_name(group)
             ? ok_status()
             : invalid_argument(
                   "{}: at most {} letters, digits, '-' and '_' are possible, and not \"rest\", got \"{}\"", path,
                   kMaxLightGroupName, printable(group));
}

}  // namespace lightmill
