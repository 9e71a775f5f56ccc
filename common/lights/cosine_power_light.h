// Point lights whose intensity falls off with a power of the cosine: I(θ) = I₀ cosⁿθ for θ < 90°.
#pragma once

#include "common/lights/directed_point_lights.h"
#include "common/lights/point_light.h"

namespace lightmill {

struct CosinePowerEmitter {
  Vec3 position;
  Vec3 direction;  ///< unit
  Vec3 intensity;  ///< W/sr along the direction
  float exponent = 1;
};

class CosinePowerLights {
 public:
  void add(const CosinePowerEmitter& light);
  std::size_t size() const { return points_.size(); }
  LightBounds bounds(std::size_t i) const;
  LightSample8 sample(const V8& p, U8 index, M8 lanes) const;

  V8 position(U8 index, M8 lanes) const { return points_.position(index, lanes); }
  /// In unit directions, W/sr.
  V8 intensity(const V8& direction, U8 index, M8 lanes) const;

 private:
  IntensityShare8 share(const V8& direction, U8 index, M8 lanes) const;

  DirectedPointLights points_;
  std::vector<float> exponent_;
};

}  // namespace lightmill
