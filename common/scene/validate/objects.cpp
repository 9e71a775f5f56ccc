#include "common/scene/validate/parts.h"

#include <cmath>

namespace lightmill {
namespace {

/// The columns of the linear part must span space. For a sphere they must be orthogonal and equally long.
Status check_transform(const std::string& path, const Object& object) {
  const Transform& t = object.transform;
  for (const auto& row : t) {
    for (const double value : row) {
      if (!(std::abs(value) <= kMaxCoordinate)) {
        return invalid_argument("{}: numbers must be finite and at most {}, got {}", path, kMaxCoordinate, value);
      }
    }
  }
  if (!spans_space(t)) {
    return invalid_argument("{}: the map is not invertible (a scale of zero, or axes in one plane)", path);
  }
  const double unit = std::hypot(t[0][0], t[1][0], t[2][0]);
  const auto column = [&](std::size_t i) { return Point3d{t[0][i] / unit, t[1][i] / unit, t[2][i] / unit}; };
  const Point3d x = column(0), y = column(1), z = column(2);
  const double length2 = dot(x, x);
  const bool similar = std::abs(dot(y, y) - length2) <= 1e-9 * length2 &&
                       std::abs(dot(z, z) - length2) <= 1e-9 * length2 && std::abs(dot(x, y)) <= 1e-9 * length2 &&
                       std::abs(dot(y, z)) <= 1e-9 * length2 && std::abs(dot(z, x)) <= 1e-9 * length2;
  if (std::holds_alternative<SphereShape>(object.shape) && !similar) {
    return invalid_argument("{}: a sphere can be moved, rotated and scaled equally along all axes, not be distorted",
                            path);
  }
  return ok_status();
}

}  // namespace

bool spans_space(const Transform& t) {
  constexpr double kShortest = 1e-30;  // smaller volumes would underflow
  std::array<Point3d, 3> axes{};
  for (std::size_t i = 0; i < 3; ++i) {
    const Point3d axis{t[0][i], t[1][i], t[2][i]};
    if (!(length(axis) >= kShortest)) {
      return false;
    }
    axes[i] = normalize(axis);
  }
  const auto& [x, y, z] = axes;
  return std::abs(dot(x, cross(y, z))) > 1e-12;
}

Status check_object(const std::string& path, const Object& object, std::size_t materials) {
  if (object.material >= materials) {
    return invalid_argument("{}.material: index {} is out of range, there are {} materials", path, object.material,
                            materials);
  }
  if (const auto* sphere = std::get_if<SphereShape>(&object.shape)) {
    LM_RETURN_IF_ERROR(check_point(path + ".sphere.center", sphere->center));
    if (!(sphere->radius > 0 && sphere->radius <= kMaxCoordinate)) {
      return invalid_argument("{}.sphere.radius: must be positive and at most {}, got {}", path, kMaxCoordinate,
                              sphere->radius);
    }
  } else if (const auto* plane = std::get_if<PlaneShape>(&object.shape)) {
    LM_RETURN_IF_ERROR(check_point(path + ".plane.point", plane->point));
    LM_RETURN_IF_ERROR(check_direction(path + ".plane.normal", plane->normal));
  } else if (const auto* triangle = std::get_if<TriangleShape>(&object.shape)) {
    LM_RETURN_IF_ERROR(check_point(path + ".triangle.a", triangle->a));
    LM_RETURN_IF_ERROR(check_point(path + ".triangle.b", triangle->b));
    LM_RETURN_IF_ERROR(check_point(path + ".triangle.c", triangle->c));
  }
  return check_transform(path + ".transform", object);
}

}  // namespace lightmill
