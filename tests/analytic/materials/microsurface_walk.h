// Light that walks over a random surface of GGX facets until it leaves: Heitz et al. 2016, "Multiple-Scattering
// Microfacet BSDFs with the Smith Model". Double precision, and no code of the renderer.
#pragma once

#include <cmath>
#include <random>

#include "common/math/vec.h"

namespace lightmill::test {

/// Albedos from a direction in uniform light: of light that meets one facet, and of all light.
struct WalkedAlbedo {
  double once = 0, all = 0;
};

/// `fresnel(cos θ)` is a facet's reflectance. Normal +z.
template <class Fresnel>
WalkedAlbedo walked_albedo(const Vec3d& wo, double alpha, Fresnel fresnel, int walks, std::uint64_t seed) {
  std::mt19937_64 bits(seed);
  const auto uniform = [&] { return static_cast<double>(bits() >> 11) * 0x1p-53; };
  const auto lambda = [&](const Vec3d& w) {
    const double root = std::sqrt(w.z * w.z + alpha * alpha * (1 - w.z * w.z));
    return (-1 + root / w.z) / 2;
  };
  // Dupuy and Benyoub 2023, for directions above and below the horizon.
  const auto visible_normal = [&](const Vec3d& w) {
    const Vec3d stretched = glm::normalize(Vec3d(alpha * w.x, alpha * w.y, w.z));
    const double phi = 2 * M_PI * uniform(), z = (1 - uniform()) * (1 + stretched.z) - stretched.z;
    const double r = std::sqrt(std::max(0.0, 1 - z * z));
    const Vec3d h = Vec3d(r * std::cos(phi), r * std::sin(phi), z) + stretched;
    return glm::normalize(Vec3d(alpha * h.x, alpha * h.y, h.z));
  };
  WalkedAlbedo albedo;
  for (int i = 0; i < walks; ++i) {
    Vec3d ray = -wo;
    double below = 1;  // share of the surface below the current height
    double light = 1;
    for (int bounce = 0; bounce < 1000; ++bounce) {
      const double l = lambda(ray), u = 1 - uniform();
      if (ray.z > 0 && u < std::pow(below, l)) {
        albedo.once += bounce == 1 ? light : 0;
        albedo.all += light;
        break;
      }
      below *= std::pow(u, -1 / l);
      const Vec3d m = visible_normal(-ray);
      const double cosine = -glm::dot(ray, m);
      light *= fresnel(cosine);
      ray = glm::normalize(ray + m * (2 * cosine));
    }
  }
  return {albedo.once / walks, albedo.all / walks};
}

}  // namespace lightmill::test
