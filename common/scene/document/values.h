// Points and colours of the scene document. Lengths are in scene units (metres if it matters), angles in degrees.
#pragma once

#include <array>
#include <cmath>

namespace lightmill {

using Point3d = std::array<double, 3>;  ///< x, y, z; also a vector

inline Point3d difference(const Point3d& a, const Point3d& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
inline double dot(const Point3d& a, const Point3d& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
inline Point3d cross(const Point3d& a, const Point3d& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
inline double length(const Point3d& a) {
  return std::hypot(a[0], a[1], a[2]);
}
inline Point3d normalize(const Point3d& a) {
  return {a[0] / length(a), a[1] / length(a), a[2] / length(a)};
}

inline constexpr double kMaxCoordinate = 1e12;  ///< of any point, scene units: squares must fit into single precision

/// Linear RGB with Rec. 709 primaries. The schema has room for other kinds, such as a spectrum.
struct RgbColor {
  float r = 0, g = 0, b = 0;
  friend bool operator==(const RgbColor&, const RgbColor&) = default;
};
inline bool is_black(const RgbColor& color) {
  return color == RgbColor{};
}

}  // namespace lightmill
