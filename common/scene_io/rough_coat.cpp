#include "common/scene_io/rough_coat.h"

#include <cmath>
#include <numbers>

namespace lightmill {
namespace {

/// Reflectance of a smooth dielectric. 1 for total reflection.
double facet_reflectance(double cosine, double ior) {
  const double under = ior * ior - 1 + cosine * cosine;
  if (under <= 0) {
    return 1;
  }
  const double t = std::sqrt(under);
  const double s = (cosine - t) / (cosine + t), p = (ior * ior * cosine - t) / (ior * ior * cosine + t);
  return (s * s + p * p) / 2;
}

/// Smith's G1. That of Beckmann is the rational approximation of Walter et al.
double seen_share(double cosine, double alpha, CoatFacets facets) {
  const double tan2 = (1 - cosine * cosine) / (cosine * cosine) * alpha * alpha;
  if (facets != CoatFacets::beckmann) {
    return 2 / (1 + std::sqrt(1 + tan2));
  }
  const double a = tan2 > 0 ? 1 / std::sqrt(tan2) : 2;
  return a >= 1.6 ? 1 : (3.535 * a + 2.181 * a * a) / (1 + 2.276 * a + 2.577 * a * a);
}

/// The share of facets that are seen from both directions, from the shares for each.
double seen_by_both(double first, double second, CoatFacets facets) {
  return facets == CoatFacets::ggx_correlated ? 1 / (1 / first + 1 / second - 1) : first * second;
}

}  // namespace

RoughCoat rough_coat(double ior, double alpha, CoatFacets facets, double depth) {
  constexpr int kDirections = 64, kSlopes = 24, kAzimuths = 8;
  RoughCoat out;
  for (int i = 0; i < kDirections; ++i) {
    const double mu = std::sqrt((i + 0.5) / kDirections), sine = std::sqrt(1 - mu * mu);
    for (int j = 0; j < kSlopes; ++j) {
      const double rest = (j + 0.5) / kSlopes;
      const double steeper = rest * rest;  // share of facets. Steep ones matter most
      const double tan2 = alpha * alpha * (facets == CoatFacets::beckmann ? -std::log(steeper) : 1 / steeper - 1);
      const double up = 1 / std::sqrt(1 + tan2), aside = std::sqrt(tan2) * up;  // of the facet's normal
      for (int k = 0; k < kAzimuths; ++k) {
        const double c = sine * aside * std::cos(std::numbers::pi * (k + 0.5) / kAzimuths) + mu * up;
        if (c <= 0) {
          continue;
        }
        const double weight = c / (mu * up) * 2 * rest / (kDirections * kSlopes * kAzimuths);
        const double seen = seen_share(mu, alpha, facets);
        const double outside = facet_reflectance(c, ior);
        const double reflected = 2 * c * up - mu;  // the height of the reflected direction
        if (reflected > 0) {
          const double leaves = weight * seen_by_both(seen, seen_share(reflected, alpha, facets), facets);
          out.reflects += leaves * outside;
          out.reflects_inside += leaves * facet_reflectance(c, 1 / ior) * std::exp(-depth / mu - depth / reflected);
        }
        const double refracted =
            outside < 1 ? (up * (std::sqrt(ior * ior - 1 + c * c) - c) + mu) / ior : 0;  // the depth
        if (refracted > 0) {
          out.enters += weight * (1 - outside) * std::exp(-depth / refracted) *
                        seen_by_both(seen, seen_share(refracted, alpha, facets), facets);
        }
      }
    }
  }
  return out;
}

}  // namespace lightmill
