// Directional lights: parallel light from infinitely far away.
#pragma once

#include "common/lights/light_sample.h"

namespace lightmill {

struct DirectionalEmitter {
  Vec3 direction;   ///< unit, the direction of travel
  Vec3 irradiance;  ///< W/m² on a surface that faces it
};

class DirectionalLights {
 public:
  void add(const DirectionalEmitter& light) {
    direction_.add(light.direction);
    irradiance_.add(light.irradiance);
  }
  std::size_t size() const { return direction_.size(); }
  DistantBounds bounds(std::size_t i) const;
  LightSample8 sample(const V8& p, U8 index, M8 lanes) const;

 private:
  VectorRows direction_, irradiance_;
};

}  // namespace lightmill
