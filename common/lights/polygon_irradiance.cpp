#include "common/lights/polygon_irradiance.h"

#include <array>

#include "common/base/check.h"
#include "common/math/transcendental.h"

namespace lightmill {

double polygon_irradiance(std::span<const Vec3d> corners, const Vec3d& n) {
  LM_CHECK(corners.size() <= kMostPolygonCorners);
  // The part above the horizon has one corner more. There is room for more, because rounding can make a polygon in the
  // horizon cross it often.
  std::array<Vec3d, 2 * kMostPolygonCorners> above;
  std::size_t number = 0;
  for (std::size_t k = 0; k < corners.size(); ++k) {
    const Vec3d &a = corners[k], &b = corners[(k + 1) % corners.size()];
    const double height_a = glm::dot(a, n), height_b = glm::dot(b, n);
    if (height_a >= 0) {
      above[number++] = a;
    }
    if ((height_a >= 0) != (height_b >= 0)) {
      above[number++] = a + (b - a) * (height_a / (height_a - height_b));
    }
  }
  double sum = 0;
  for (std::size_t k = 0; k < number; ++k) {
    const Vec3d &a = above[k], &b = above[(k + 1) % number];
    const Vec3d across = glm::cross(a, b);
    const double sine = glm::length(across);
    if (sine > 0) {
      sum += atan2_fixed(sine, glm::dot(a, b)) * glm::dot(across, n) / sine;
    }
  }
  return 0.5 * std::abs(sum);
}

}  // namespace lightmill
