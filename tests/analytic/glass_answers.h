// Exact answers for smooth glass, and the material.
#pragma once

#include <fmt/format.h>

#include <cmath>
#include <string>

namespace lightmill::test {

/// A material's JSON.
inline std::string glass(double ior) {
  return fmt::format(R"({{"name": "glass", "dielectric": {{"ior": {}}}}})", ior);
}

/// Fresnel's reflectance of unpolarised light, by sines and tangents (Hecht, Optics, 4.43 and 4.44). `theta` is the
/// angle to the normal in radians, and n the index behind the surface over the index in front.
inline double fresnel(double theta, double n) {
  if (theta == 0) {
    return std::pow((n - 1) / (n + 1), 2);
  }
  const double sine = std::sin(theta) / n;
  if (sine >= 1) {
    return 1;
  }
  const double t = std::asin(sine);
  return (std::pow(std::sin(theta - t) / std::sin(theta + t), 2) +
          std::pow(std::tan(theta - t) / std::tan(theta + t), 2)) /
         2;
}

/// Irradiance at distance x from the foot of a point light of intensity I = π at height h, at depth d in a half-space
/// of index n. Light that leaves in a ring of directions arrives in a ring of the floor.
inline double point_through_surface(double x, double n, double h, double d) {
  const auto reached = [&](double theta) { return h * std::tan(theta) + d * std::tan(std::asin(std::sin(theta) / n)); };
  if (x == 0) {
    return M_PI * (1 - fresnel(0, n)) / std::pow(h + d / n, 2);
  }
  double low = 0, high = 1.5;
  for (int i = 0; i < 60; ++i) {
    (reached((low + high) / 2) < x ? low : high) = (low + high) / 2;
  }
  const double step = 1e-5, slope = (reached(low + step) - reached(low - step)) / (2 * step);
  return M_PI * (1 - fresnel(low, n)) * std::sin(low) / (x * slope);
}

}  // namespace lightmill::test
