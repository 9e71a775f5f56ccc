// Cones of light from a point.
#pragma once

#include "common/lights/light_sample.h"

namespace lightmill {

struct SpotEmitter {
  Vec3 position;
  Vec3 direction;  ///< unit
  Vec3 intensity;  ///< W/sr along the direction
  float cos_inner = 1, cos_outer = 0;
};

/// Intensity is full within the inner cone and zero outside the outer one; between, t²(3 − 2t) of the cosine.
class SpotLights {
 public:
  void add(const SpotEmitter& spot);
  std::size_t size() const { return position_.size(); }
  LightBounds bounds(std::size_t i) const;
  LightSample8 sample(const V8& p, U8 index, M8 lanes) const;

 private:
  VectorRows position_, direction_, intensity_;
  std::vector<float> cos_inner_, cos_outer_;
};

}  // namespace lightmill
