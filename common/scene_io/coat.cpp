#include "common/scene_io/coat.h"

#include <algorithm>
#include <cmath>

namespace lightmill {
namespace {

/// Mean reflectance of a smooth surface for uniform light from inside (Fresnel equations as in Walter et al. 2007). The
/// mean transmittance from inside is 1/η² of that from outside.
double inner_reflectance(double ior) {
  constexpr int kSteps = 256;
  double outer = 0;
  for (int i = 0; i < kSteps; ++i) {
    const double cos2 = (i + 0.5) / kSteps;  // equal steps of cos² θ
    const double c = std::sqrt(cos2), under = ior * ior - 1 + cos2;
    const double t = under > 0 ? std::sqrt(under) : 0;
    const double s = (c - t) / (c + t), p = (ior * ior * c - t) / (ior * ior * c + t);
    outer += under > 0 ? (s * s + p * p) / 2 / kSteps : 1.0 / kSteps;
  }
  return std::clamp(1 - (1 - outer) / (ior * ior), 0.0, 1.0);
}

}  // namespace

TexturedColor changed_albedo(const TexturedColor& albedo, const std::function<double(double)>& of) {
  const auto value = [&](float color) {
    const double out = albedo.texture == kNoTexture ? std::min(of(color), 1.0) : (color > 0 ? 2 * of(color / 2.0) : 0);
    return static_cast<float>(out);
  };
  return {{value(albedo.rgb.r), value(albedo.rgb.g), value(albedo.rgb.b)}, albedo.texture};
}

TexturedColor coated(const TexturedColor& albedo, double ior) {
  const double inner = inner_reflectance(ior);
  return changed_albedo(albedo, [&](double rho) { return rho * (1 - inner) / std::max(1 - rho * inner, 1e-9); });
}

}  // namespace lightmill
