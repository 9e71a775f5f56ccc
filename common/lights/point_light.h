// Point lights: equal intensity in all directions.
#pragma once

#include "common/lights/spherical_light.h"

namespace lightmill {

struct PointEmitter {
  Vec3 position;
  Vec3 intensity;    ///< W/sr
  float radius = 0;  ///< of a sphere (spherical_light.h)
};

/// A point light seen from p. Lights with a profile start with it, too.
struct PointView8 {
  V8 position;
  V8 wi;
  F8 distance2;
  M8 valid;
  PointView8(const V8& p, const V8& light, M8 lanes) : position(light) {
    const V8 to_light = position - p;
    distance2 = length_squared(to_light);
    valid = lanes & (distance2 > F8(0.0f));
    wi = to_light * (F8(1.0f) / sqrt(distance2));
  }
  /// Unit direction of travel, from the point to p.
  V8 direction() const { return -wi; }
  /// Light at p for the intensity `intensity` times `share`, in the lanes `lit`.
  LightSample8 light(const V8& intensity, F8 share, M8 lit) const {
    return {position, wi, intensity * (share / distance2), F8(0.0f), valid & lit};
  }
};

/// Share of a light's intensity in one direction.
struct IntensityShare8 {
  F8 share;
  M8 lit;  ///< the light shines in this direction
};

/// Bounds of a point that shines in all directions. `power` and `intensity`: as in LightBounds.
inline LightBounds bounds_of_point(const Vec3& position, double power, double intensity) {
  LightBounds b;
  b.low = b.high = Vec3d(position);
  b.power = power;
  b.intensity = intensity;
  return b;
}

class PointLights {
 public:
  void add(const PointEmitter& point) {
    position_.add(point.position);
    intensity_.add(point.intensity);
    radii_.add(point.radius);
  }
  std::size_t size() const { return position_.size(); }
  LightBounds bounds(std::size_t i) const;
  /// As if no light had a size.
  LightSample8 sample(const V8& p, U8 index, M8 lanes) const;
  LightSample8 sample(const V8& p, U8 index, M8 lanes, Pair8 u) const;
  V8 position(U8 index, M8 lanes) const { return position_.at(index, lanes); }
  V8 intensity(U8 index, M8 lanes) const { return intensity_.at(index, lanes); }
  V8 intensity(const V8& /*direction*/, U8 index, M8 lanes) const { return intensity(index, lanes); }
  bool has_size(std::size_t i) const { return radii_[i] > 0; }
  const SphereRadii& radii() const { return radii_; }
  /// Irradiance of a sphere on a surface at p with unit normal n, without occlusion.
  Vec3d irradiance(std::size_t i, const Vec3d& p, const Vec3d& n) const;

 private:
  VectorRows position_, intensity_;
  SphereRadii radii_;
};

}  // namespace lightmill
