#include "common/scene/validate/parts.h"

#include <algorithm>
#include <cmath>

#include "common/base/overloaded.h"

namespace lightmill {
namespace {

Status check_length(const std::string& path, double length) {
  return length > 0 && length <= kMaxCoordinate
             ? ok_status()
             : invalid_argument("{}: must be positive and at most {}, got {}", path, kMaxCoordinate, length);
}

Status check_up(const std::string& path, const Point3d& up, const Point3d& direction) {
  return !are_parallel(direction, up)
             ? ok_status()
             : invalid_argument("{}: must not be parallel to direction, got ({}, {}, {})", path, up[0], up[1], up[2]);
}

Status check_spot(const std::string& path, const SpotLight& spot) {
  LM_RETURN_IF_ERROR(check_point(path + ".spot.position", spot.position));
  LM_RETURN_IF_ERROR(check_direction(path + ".spot.direction", spot.direction));
  LM_RETURN_IF_ERROR(check_power(path + ".spot.intensity", spot.intensity));
  LM_RETURN_IF_ERROR(check_range(path + ".spot.cutoff_degrees", spot.cutoff_degrees, kMinCutoffDegrees, 180));
  LM_RETURN_IF_ERROR(check_range(path + ".spot.blend", spot.blend, 0, 1));
  return check_range(path + ".spot.radius", spot.radius, 0, kMaxCoordinate);
}

Status check_cosine_power(const std::string& path, const CosinePowerLight& light) {
  LM_RETURN_IF_ERROR(check_point(path + ".cosine_power.position", light.position));
  LM_RETURN_IF_ERROR(check_direction(path + ".cosine_power.direction", light.direction));
  LM_RETURN_IF_ERROR(check_power(path + ".cosine_power.intensity", light.intensity));
  return check_range(path + ".cosine_power.exponent", light.exponent, 0, kMaxCosineExponent);
}

Status check_disk(const std::string& path, const DiskLight& disk) {
  const std::string field = fmt::format("{}.{}.", path, disk.kind_name());
  LM_RETURN_IF_ERROR(check_point(field + "position", disk.position));
  LM_RETURN_IF_ERROR(check_direction(field + "direction", disk.direction));
  LM_RETURN_IF_ERROR(check_power(field + "radiance", disk.radiance));
  if (disk.rectangular) {
    LM_RETURN_IF_ERROR(
        check_length(field + "width", 2 * disk.second_radius));  // first, because height is width by default
    LM_RETURN_IF_ERROR(check_length(field + "height", 2 * disk.radius));
  } else {
    LM_RETURN_IF_ERROR(check_length(field + "radius", disk.radius));
    LM_RETURN_IF_ERROR(check_length(field + "second_radius", disk.second_radius));
  }
  LM_RETURN_IF_ERROR(check_direction(field + "up", disk.up));
  LM_RETURN_IF_ERROR(check_range(field + "spread_degrees", disk.spread_degrees, kMinSpreadDegrees, 180));
  return check_up(field + "up", disk.up, disk.direction);
}

Status check_ies(const std::string& path, const IesLight& ies) {
  LM_RETURN_IF_ERROR(check_point(path + ".ies.position", ies.position));
  LM_RETURN_IF_ERROR(check_direction(path + ".ies.direction", ies.direction));
  LM_RETURN_IF_ERROR(check_direction(path + ".ies.up", ies.up));
  LM_RETURN_IF_ERROR(check_power(path + ".ies.color", ies.color));
  if (ies.color == RgbColor{}) {
    return invalid_argument("{}.ies.color: must not be black. A scale of 0 turns the light off", path);
  }
  LM_RETURN_IF_ERROR(check_up(path + ".ies.up", ies.up, ies.direction));
  return check_range(path + ".ies.scale", ies.scale, 0, kMaxPower);
}

Status check_environment(const std::string& path, const EnvironmentLight& light) {
  if (light.orientation) {
    constexpr double kTolerance = 1e-3;  // of numbers with few digits
    for (std::size_t i = 0; i < 9; ++i) {
      const Point3d &a = (*light.orientation)[i / 3], &b = (*light.orientation)[i % 3];
      const double product = a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
      if (!(std::abs(product - (i / 3 == i % 3 ? 1 : 0)) <= kTolerance)) {
        return invalid_argument("{}.orientation: its rows must be perpendicular and of length 1", path);
      }
    }
  }
  LM_RETURN_IF_ERROR(check_range(path + ".rotation_degrees", light.rotation_degrees, -360, 360));
  return check_power(path + ".radiance", light.radiance);
}

Status check_light(const std::string& path, const Light& light) {
  return std::visit(
      Overloaded{
          [&](const PointLight& point) {
            LM_RETURN_IF_ERROR(check_point(path + ".point.position", point.position));
            LM_RETURN_IF_ERROR(check_power(path + ".point.intensity", point.intensity));
            return check_range(path + ".point.radius", point.radius, 0, kMaxCoordinate);
          },
          [&](const DirectionalLight& sun) {
            LM_RETURN_IF_ERROR(check_direction(path + ".directional.direction", sun.direction));
            LM_RETURN_IF_ERROR(check_power(path + ".directional.irradiance", sun.irradiance));
            return check_range(path + ".directional.angle_degrees", sun.angle_degrees, 0, 180);
          },
          [&](const SpotLight& spot) { return check_spot(path, spot); },
          [&](const CosinePowerLight& cosine_power) { return check_cosine_power(path, cosine_power); },
          [&](const DiskLight& disk) { return check_disk(path, disk); },
          [&](const IesLight& ies) { return check_ies(path, ies); },
          [&](const EnvironmentLight& environment) { return check_environment(path + ".environment", environment); },
      },
      light.kind);
}

}  // namespace

Status check_lights(const std::vector<Light>& lights) {
  bool environment = false;
  for (std::size_t i = 0; i < lights.size(); ++i) {
    LM_RETURN_IF_ERROR(check_light(fmt::format("lights[{}]", i), lights[i]));
    if (std::holds_alternative<EnvironmentLight>(lights[i].kind)) {
      if (environment) {
        return invalid_argument("lights[{}].environment: at most one light can be an environment", i);
      }
      environment = true;
    }
  }
  return ok_status();
}

Status check_environment_size(int width, int height, bool equal_area) {
  if (equal_area && width != height) {
    return invalid_argument("an environment of equal areas must be square, got {}x{}", width, height);
  }
  return std::max(width, height) <= kMaxEnvironmentSide
             ? ok_status()
             : invalid_argument("an environment may have at most {} pixels on a side, got {}x{}", kMaxEnvironmentSide,
                                width, height);
}

}  // namespace lightmill
