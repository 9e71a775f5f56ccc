// Mean reflectance of a smooth dielectric.
#pragma once

#include <cmath>

namespace lightmill::dielectric {

/// Share of uniform light that a smooth surface reflects (Fresnel's equations as in Walter et al. 2007). `ior`: index of
/// refraction behind the surface over that on the light's side.
inline double mean_reflectance(double ior) {
  constexpr int kSteps = 256;
  double sum = 0;
  for (int i = 0; i < kSteps; ++i) {
    const double cos2 = (i + 0.5) / kSteps;  // equal steps of cos² θ
    const double c = std::sqrt(cos2), under = ior * ior - 1 + cos2;
    const double t = under > 0 ? std::sqrt(under) : 0;
    const double s = (c - t) / (c + t), p = (ior * ior * c - t) / (ior * ior * c + t);
    sum += under > 0 ? (s * s + p * p) / 2 : 1;
  }
  return sum / kSteps;
}

}  // namespace lightmill::dielectric
