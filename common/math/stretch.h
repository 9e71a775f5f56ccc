// The least and the largest factor by which linear maps scale lengths: their singular values.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include <glm/mat3x3.hpp>

namespace lightmill {

/// Of a map of the plane, row by row.
inline double least_stretch(const std::array<std::array<double, 2>, 2>& m) {
  const double squares = m[0][0] * m[0][0] + m[0][1] * m[0][1] + m[1][0] * m[1][0] + m[1][1] * m[1][1];
  const double area = std::abs(m[0][0] * m[1][1] - m[0][1] * m[1][0]);
  const double largest2 = (squares + std::sqrt(std::max(squares * squares - 4 * area * area, 0.0))) / 2;
  return largest2 > 0 ? area / std::sqrt(largest2) : 0;
}

/// Of a map of space. Only exactly rounded operations, so its bits are fixed.
inline double largest_stretch(const glm::dmat3& m) {
  // The powers of mᵀm approach a multiple of vvᵀ, where v is the direction that is stretched most.
  glm::dmat3 power = glm::transpose(m) * m;
  constexpr int kSquarings = 8;
  for (int i = 0; i < kSquarings; ++i) {
    const double trace = power[0][0] + power[1][1] + power[2][2];
    if (!(trace > 0)) {
      return 0;
    }
    power = (power / trace) * (power / trace);
  }
  int most = 0;
  for (int i = 1; i < 3; ++i) {
    most = power[i][i] > power[most][most] ? i : most;
  }
  const glm::dvec3 v = power[most], moved = m * v;
  const auto length2 = [](const glm::dvec3& x) { return x.x * x.x + x.y * x.y + x.z * x.z; };
  return std::sqrt(length2(moved) / length2(v));
}

}  // namespace lightmill
