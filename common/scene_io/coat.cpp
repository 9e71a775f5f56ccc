#include "common/scene_io/coat.h"

#include <algorithm>

#include "common/materials/mean_reflectance.h"

namespace lightmill {
double inner_reflectance(double ior) {
  // The mean transmittance from inside is 1/η² of that from outside.
  return std::clamp(1 - (1 - dielectric::mean_reflectance(ior)) / (ior * ior), 0.0, 1.0);
}

double below_coat(double albedo, double inner_reflectance) {
  return albedo * (1 - inner_reflectance) / std::max(1 - albedo * inner_reflectance, 1e-9);
}

void set_base_color(PrincipledMaterial& out, const TexturedColor& albedo, const std::function<double(double)>& of,
                    double inner_reflectance) {
  const bool textured = albedo.texture != kNoTexture;
  double r = textured ? std::clamp(inner_reflectance, 0.0, kMaxInnerReflectance) : 0;
  // Of a texture: the factor with which texels of 1/2 are below the coat what they should be.
  const auto unbounded = [&](float color) {
    const double half = textured && color > 0 ? of(color / 2.0) : 0;
    return textured ? 2 * half / (1 - r + r * half) : of(color);
  };
  constexpr double kRounding = 0.01;  // of the integrals over the coat
  if (std::max({unbounded(albedo.rgb.r), unbounded(albedo.rgb.g), unbounded(albedo.rgb.b)}) > 1 + kRounding) {
    r = 0;
  }
  out.inner_reflectance = r;
  const auto value = [&](float color) { return static_cast<float>(std::min(unbounded(color), 1.0)); };
  out.base_color = {{value(albedo.rgb.r), value(albedo.rgb.g), value(albedo.rgb.b)}, albedo.texture};
}

}  // namespace lightmill
