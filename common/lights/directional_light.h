// Directional lights: light from infinitely far away, parallel or from a disk in the sky.
#pragma once

#include "common/lights/light_sample.h"

namespace lightmill {

struct DirectionalEmitter {
  Vec3 direction;   ///< unit, the direction of travel from the middle
  Vec3 irradiance;  ///< W/m² on a surface that faces it
  /// 1 − cos of the disk's half angle; 0: parallel light. In this form, single precision resolves small angles.
  float one_minus_cos = 0;
};

/// Disks have the same radiance everywhere. Their directions are sampled uniformly.
class DirectionalLights {
 public:
  void add(const DirectionalEmitter& light);
  std::size_t size() const { return direction_.size(); }
  DistantBounds bounds(std::size_t i) const;
  bool has_size(std::size_t i) const { return one_minus_cos_[i] > 0; }

  LightSample8 sample(const V8& p, U8 index, M8 lanes, Pair8 u) const;
  /// All of the light from the middle.
  LightSample8 sample(const V8& p, U8 index, M8 lanes) const;
  /// Density per solid angle of directions to the light; 0 outside the disk, and for parallel light.
  F8 pdf_solid_angle(const V8& to_light, U8 index, M8 lanes) const;
  /// Radiance of a disk.
  V8 radiance(U8 index, M8 lanes) const;
  /// Irradiance on surfaces with unit normals n, without occlusion.
  Vec3d irradiance(std::size_t i, const Vec3d& p, const Vec3d& n) const;

 private:
  VectorRows direction_, irradiance_;
  std::vector<float> one_minus_cos_;
  bool has_disks_ = false;
};

}  // namespace lightmill
