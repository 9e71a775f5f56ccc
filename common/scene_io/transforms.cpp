#include "common/scene_io/transforms.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/scene/validate/validate.h"

namespace lightmill {
namespace {

Point3d axis_of(const Transform& t, std::size_t column) {
  return {t[0][column], t[1][column], t[2][column]};
}

}  // namespace

Transform compose(const Transform& a, const Transform& b) {
  Transform out;
  for (std::size_t row = 0; row < 3; ++row) {
    for (std::size_t column = 0; column < 4; ++column) {
      out[row][column] = a[row][0] * b[0][column] + a[row][1] * b[1][column] + a[row][2] * b[2][column] +
                         (column == 3 ? a[row][3] : 0);
    }
  }
  return out;
}

Transform translation(const Point3d& by) {
  return {{{1, 0, 0, by[0]}, {0, 1, 0, by[1]}, {0, 0, 1, by[2]}}};
}

Transform scaling(const Point3d& by) {
  return {{{by[0], 0, 0, 0}, {0, by[1], 0, 0}, {0, 0, by[2], 0}}};
}

Transform rotation(double degrees, const Point3d& axis) {
  const auto [x, y, z] = normalize(axis);
  const double angle = std::remainder(degrees, 360) * std::numbers::pi / 180;
  const double s = std::sin(angle), c = std::cos(angle), d = 1 - c;
  // Rodrigues' formula.
  return {{{c + x * x * d, x * y * d - z * s, x * z * d + y * s, 0},
           {y * x * d + z * s, c + y * y * d, y * z * d - x * s, 0},
           {z * x * d - y * s, z * y * d + x * s, c + z * z * d, 0}}};
}

double determinant(const Transform& t) {
  return dot(axis_of(t, 0), cross(axis_of(t, 1), axis_of(t, 2)));
}

std::optional<Transform> inverse(const Transform& t) {
  if (!spans_space(t)) {
    return std::nullopt;
  }
  const Point3d x = axis_of(t, 0), y = axis_of(t, 1), z = axis_of(t, 2), moved = axis_of(t, 3);
  const double volume = determinant(t);
  const std::array<Point3d, 3> rows{cross(y, z), cross(z, x), cross(x, y)};
  Transform out;
  for (std::size_t row = 0; row < 3; ++row) {
    for (std::size_t column = 0; column < 3; ++column) {
      out[row][column] = rows[row][column] / volume;
    }
    out[row][3] = -dot(rows[row], moved) / volume;
  }
  return out;
}

Point3d map_point(const Transform& t, const Point3d& p) {
  const Point3d v = map_vector(t, p);
  return {v[0] + t[0][3], v[1] + t[1][3], v[2] + t[2][3]};
}

Point3d map_vector(const Transform& t, const Point3d& v) {
  Point3d out;
  for (std::size_t row = 0; row < 3; ++row) {
    out[row] = t[row][0] * v[0] + t[row][1] * v[1] + t[row][2] * v[2];
  }
  return out;
}

std::optional<double> similarity_scale(const Transform& t) {
  constexpr double kTolerance = 1e-4;  // programs write matrices with few digits
  const Point3d x = axis_of(t, 0), y = axis_of(t, 1), z = axis_of(t, 2);
  const double xx = dot(x, x), limit = kTolerance * xx;
  const bool similar = xx > 0 && std::abs(dot(y, y) - xx) <= limit && std::abs(dot(z, z) - xx) <= limit &&
                       std::abs(dot(x, y)) <= limit && std::abs(dot(y, z)) <= limit && std::abs(dot(z, x)) <= limit;
  return similar ? std::optional(std::sqrt(xx)) : std::nullopt;
}

std::optional<std::array<Point3d, 3>> orientation_of(const Transform& to_scene) {
  if (!similarity_scale(to_scene)) {
    return std::nullopt;
  }
  return std::array{normalize(axis_of(to_scene, 0)), normalize(axis_of(to_scene, 1)), normalize(axis_of(to_scene, 2))};
}

std::optional<Transform> looking_at(const Point3d& eye, const Point3d& at, const Point3d& up) {
  const Point3d z = normalize(difference(at, eye)), x = normalize(cross(normalize(up), z)), y = cross(z, x);
  const Transform out{{{x[0], y[0], z[0], eye[0]}, {x[1], y[1], z[1], eye[1]}, {x[2], y[2], z[2], eye[2]}}};
  return spans_space(out) ? std::optional(out) : std::nullopt;
}

Camera camera_along_z(const Transform& to_scene) {
  const Point3d eye = axis_of(to_scene, 3), ahead = axis_of(to_scene, 2);
  // A step of the coordinates' size, so that it survives their rounding.
  const double step =
      std::max({1.0, std::abs(eye[0]), std::abs(eye[1]), std::abs(eye[2])}) / std::sqrt(dot(ahead, ahead));
  Camera out;
  out.eye = eye;
  out.look_at = {eye[0] + ahead[0] * step, eye[1] + ahead[1] * step, eye[2] + ahead[2] * step};
  out.up = axis_of(to_scene, 1);
  return out;
}

}  // namespace lightmill
