#include "common/scene_io/coat.h"

#include <algorithm>

#include "common/materials/mean_reflectance.h"

namespace lightmill {
namespace {

/// Mean reflectance for uniform light from inside. The mean transmittance from inside is 1/η² of that from outside.
double inner_reflectance(double ior) {
  return std::clamp(1 - (1 - dielectric::mean_reflectance(ior)) / (ior * ior), 0.0, 1.0);
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
