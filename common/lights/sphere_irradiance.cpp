#include "common/lights/sphere_irradiance.h"

#include <algorithm>
#include <cmath>

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

}  // namespace lightmill
