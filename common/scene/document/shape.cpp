#include "common/scene/document/shape.h"

#include <cmath>

namespace lightmill {

bool spans_space(const Transform& t) {
  constexpr double kShortest = 1e-30;  // volumes below its cube would leave the range of numbers
  std::array<Point3d, 3> axes{};
  for (std::size_t i = 0; i < 3; ++i) {
    const double length = std::hypot(t[0][i], t[1][i], t[2][i]);
    if (!(length >= kShortest)) {
      return false;
    }
    axes[i] = {t[0][i] / length, t[1][i] / length, t[2][i] / length};
  }
  const auto& [x, y, z] = axes;
  const double determinant =
      x[0] * (y[1] * z[2] - y[2] * z[1]) + x[1] * (y[2] * z[0] - y[0] * z[2]) + x[2] * (y[0] * z[1] - y[1] * z[0]);
  return std::abs(determinant) > 1e-12;
}

}  // namespace lightmill
