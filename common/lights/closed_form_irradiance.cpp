#include "common/lights/closed_form_irradiance.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "common/base/check.h"
#include "common/math/transcendental.h"

namespace lightmill {

double sphere_irradiance(const Vec3d& to_center, double radius, const Vec3d& n) {
  const double distance = glm::length(to_center);
  const double h2 = distance * distance / (radius * radius);
  const double cosine = std::clamp(glm::dot(to_center, n) / distance, -1.0, 1.0);
  const double cut = 1 - h2 * cosine * cosine;  // positive: the sphere reaches through the horizon
  if (cut <= 0) {
    return kPiDouble * std::max(cosine, 0.0) / h2;
  }
  const double x = -cosine * std::sqrt((h2 - 1) / (1 - cosine * cosine));
  const double angle = atan2_fixed(std::sqrt(std::max(1 - x * x, 0.0)), x);
  return (cosine * angle - std::sqrt(cut * (h2 - 1))) / h2 + atan2_fixed(std::sqrt(cut), std::sqrt(h2 - 1));
}

double polygon_irradiance(std::span<const Vec3d> corners, const Vec3d& n) {
  LM_CHECK(corners.size() <= kMaxPolygonCorners);
  // The part above the horizon has one corner more. There is room for many more: through rounding, a polygon in the
  // horizon can cross it often.
  std::array<Vec3d, 2 * kMaxPolygonCorners> above;
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
