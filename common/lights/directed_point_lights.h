// Point lights with a direction: the common part of spot and cosine-power lights.
#pragma once

#include "common/lights/light_sample.h"

namespace lightmill {

/// Rows of position, direction (unit) and intensity along it (W/sr). The lights add their falloff.
class DirectedPointLights {
 public:
  void add(const Vec3& position, const Vec3& direction, const Vec3& intensity);
  std::size_t size() const { return position_.size(); }

  /// Bounds of a light with a flux of `solid_angle` (sr) times its intensity. The cosines are as in LightBounds.
  LightBounds bounds(std::size_t i, double cos_normals, double cos_emission, double solid_angle) const;

  V8 position(U8 index, M8 lanes) const { return position_.at(index, lanes); }
  V8 direction(U8 index, M8 lanes) const { return direction_.at(index, lanes); }
  V8 intensity(U8 index, M8 lanes) const { return intensity_.at(index, lanes); }

 private:
  VectorRows position_, direction_, intensity_;
};

}  // namespace lightmill
