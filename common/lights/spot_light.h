// Spot lights: cones of light from a point.
#pragma once

#include "common/lights/directed_point_lights.h"
#include "common/lights/point_light.h"

namespace lightmill {

struct SpotEmitter {
  Vec3 position;
  Vec3 direction;  ///< unit
  Vec3 intensity;  ///< W/sr along the direction
  /// 1 − cos of the angles to the direction. In this form, single precision resolves narrow cones.
  float inner = 0, outer = 1;
  float radius = 0;  ///< of a sphere (spherical_light.h)
};

/// Intensity is full within the inner cone and zero outside the outer one. Between them it is t²(3 − 2t) of the cosine.
class SpotLights {
 public:
  void add(const SpotEmitter& spot);
  std::size_t size() const { return points_.size(); }
  LightBounds bounds(std::size_t i) const;
  /// As if no light had a size.
  LightSample8 sample(const V8& p, U8 index, M8 lanes) const;
  LightSample8 sample(const V8& p, U8 index, M8 lanes, Pair8 u) const;

  V8 position(U8 index, M8 lanes) const { return points_.position(index, lanes); }
  /// In unit directions, W/sr.
  V8 intensity(const V8& direction, U8 index, M8 lanes) const;
  /// 1 − cos of the angle beyond which there is no light.
  double one_minus_cos_cutoff(std::size_t i) const { return outer_[i]; }
  bool has_size(std::size_t i) const { return radii_[i] > 0; }
  const SphereRadii& radii() const { return radii_; }
  /// Irradiance of a sphere on a surface at p with unit normal n, without occlusion. All of the sphere counts with the
  /// intensity of the direction from its centre to p. This is exact where p lies so far inside or outside the cone that
  /// all points of the sphere agree.
  Vec3d irradiance(std::size_t i, const Vec3d& p, const Vec3d& n) const;

 private:
  IntensityShare8 share(const V8& direction, U8 index, M8 lanes) const;

  DirectedPointLights points_;
  std::vector<float> inner_, outer_;
  SphereRadii radii_;
};

}  // namespace lightmill
