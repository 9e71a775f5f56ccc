// Emission of surfaces of any shape: radiance with a cosine profile, on one side or both.
#pragma once

#include "common/lights/light_sample.h"

namespace lightmill {

/// Rows of radiance along the normal (W/(m² sr)), cosine exponent, and sides.
class SurfaceEmission {
 public:
  void add(const Vec3& radiance, float exponent, bool two_sided);

  bool two_sided(std::size_t i) const { return two_sided_[i] == 1; }
  M8 two_sided(U8 index, M8 lanes) const {
    return any_two_sided_ ? gather(two_sided_.data(), index, lanes) == U8(1u) : M8();
  }

  float exponent(std::size_t i) const { return exponent_[i]; }
  /// Along the normal.
  Vec3 radiance(std::size_t i) const { return radiance_[i]; }
  /// `cos_light`: cosine between direction and normal, not negative where it matters.
  V8 radiance(U8 index, F8 cos_light, M8 lanes) const {
    const V8 along_normal = radiance_.at(index, lanes);
    return has_exponents_ ? along_normal * share(index, cos_light, lanes) : along_normal;
  }

  /// Luminance of the flux per unit of area, over both sides if both emit.
  double exitance(std::size_t i) const { return exitance(i, Vec3d(radiance_[i])); }
  /// The same with this radiance along the normal.
  double exitance(std::size_t i, const Vec3d& radiance) const;

 private:
  F8 share(U8 index, F8 cos_light, M8 lanes) const;

  VectorRows radiance_;
  std::vector<float> exponent_;
  std::vector<std::uint32_t> two_sided_;
  bool any_two_sided_ = false;
  bool has_exponents_ = false;
};

}  // namespace lightmill
