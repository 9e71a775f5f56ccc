// Points that radiate equally in all directions.
#pragma once

#include "common/lights/light_sample.h"

namespace lightmill {

struct PointEmitter {
  Vec3 position;
  Vec3 intensity;  ///< W/sr
};

/// How a point looks from p; the lights with a profile begin with it as well.
struct PointView8 {
  V8 wi;
  F8 distance2;
  M8 valid;
  PointView8(const V8& p, const V8& position, M8 lanes) {
    const V8 to_light = position - p;
    distance2 = length_squared(to_light);
    valid = lanes & (distance2 > F8(0.0f));
    wi = to_light * (F8(1.0f) / sqrt(distance2));
  }
};

class PointLights {
 public:
  void add(const PointEmitter& point) {
    position_.add(point.position);
    intensity_.add(point.intensity);
  }
  std::size_t size() const { return position_.size(); }
  LightBounds bounds(std::size_t i) const;
  LightSample8 sample(const V8& p, U8 index, M8 lanes) const;

 private:
  VectorRows position_, intensity_;
};

}  // namespace lightmill
