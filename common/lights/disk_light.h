// Disk, ellipse and rectangle lights, which emit on one side.
#pragma once

#include "common/lights/light_sample.h"
#include "common/math/transcendental.h"

namespace lightmill {

struct DiskEmitter {
  Vec3 center;
  Vec3 half_axis1, half_axis2;  ///< perpendicular; emits to the side of half_axis1 × half_axis2
  Vec3 radiance;                ///< W/(m² sr) along the normal
  double spread = kPiDouble;    ///< opening of the cone of light, in radians; the radiance falls off to its rim
  bool rectangular = false;     ///< a rectangle with the corners center ± half_axis1 ± half_axis2
};

/// At θ to the normal, the radiance is max(1 − tan θ / tan(spread/2), 0) times that along the normal. This is the share
/// of light that a grid of slats lets pass. Sampled uniformly by area.
class DiskLights {
 public:
  void add(const DiskEmitter& disk);
  std::size_t size() const { return center_.size(); }
  LightBounds bounds(std::size_t i) const;
  static bool has_size(std::size_t /*i*/) { return true; }

  LightSample8 sample(const V8& p, U8 index, M8 lanes, Pair8 u) const;
  /// All of the light from the centre.
  LightSample8 sample(const V8& p, U8 index, M8 lanes) const;
  /// Uniform by area.
  EmissionPoint8 emission_point(U8 index, M8 lanes, Pair8 u) const;
  V8 normal(U8 index, M8 lanes) const { return normal_.at(index, lanes); }
  /// `cos_light`: cosine between direction and normal, not negative.
  V8 radiance(U8 index, F8 cos_light, M8 lanes) const;

  struct Entry8 {
    M8 hit;
    F8 distance, cosine;
  };
  /// Where rays with unit directions meet the emitting side.
  Entry8 meet(const V8& origin, const V8& direction, U8 index, M8 lanes) const;
  /// Density per solid angle of a point of `sample`, met by a ray of this length.
  F8 pdf_solid_angle(U8 index, F8 distance, F8 cos_light, M8 lanes) const;

  /// Irradiance on a surface at p with unit normal n, without occlusion. A round edge counts as a polygon of equal
  /// area, which is accurate to 1e-3. The spread must be π.
  Vec3d irradiance(std::size_t i, const Vec3d& p, const Vec3d& n) const;

 private:
  double area(std::size_t i) const { return 1.0 / static_cast<double>(density_[i]); }
  M8 rectangular(U8 index, M8 lanes) const {
    return has_rectangles_ ? gather(rectangular_.data(), index, lanes) == U8(1u) : M8();
  }
  V8 point(U8 index, M8 lanes, Pair8 u) const;

  VectorRows center_, half_axis1_, half_axis2_, normal_, radiance_;
  std::vector<float> density_;  ///< 1 / area
  std::vector<double> spread_;
  std::vector<float> cot_;                  ///< of half the spread
  std::vector<std::uint32_t> rectangular_;  ///< 1 or 0
  bool has_spread_ = false, has_rectangles_ = false;
};

}  // namespace lightmill
