// Light from infinitely far away on all sides: one colour, or an image of equal longitudes and latitudes.
#pragma once

#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "common/lights/light_sample.h"
#include "common/sampling/piecewise_2d.h"

namespace lightmill {

/// An image's columns are longitudes: its centre is seen towards +x, and going right turns towards +z. Its rows are
/// latitudes: the top is +y. Values are radiances at the pixels' centres, bilinear between; columns go round, and
/// beyond the first and last row's centres the rows are constant.
class EnvironmentRadiance {
 public:
  /// Where is no environment.
  EnvironmentRadiance() = default;
  /// The same radiance, W/(m² sr), from everywhere.
  explicit EnvironmentRadiance(const Vec3& radiance) : there_(true), scale_(radiance) {}
  /// An image of RGB values, interleaved, row by row, finite and not negative; fewer than 2^29 pixels. Radiance is its
  /// values times `scale`. It is turned about +y by `rotation_degrees`, from +x towards −z.
  EnvironmentRadiance(std::vector<float> rgb, std::size_t width, std::size_t height, const Vec3& scale,
                      double rotation_degrees);

  bool exists() const { return there_; }
  /// Radiance from where unit directions point.
  V8 radiance(const V8& direction) const;
  /// Its mean over all directions; of an image that of its pixels, which takes some time.
  Vec3d mean_radiance() const;

  /// Whether `sample` draws anything. Directions are drawn for what is brighter than the mean alone (Karlík et al.
  /// 2019, "MIS Compensation"): the rest, and with it all of a constant environment, is left to rays that scatter
  /// there.
  bool samplable() const { return density_.has_value(); }
  LightSample8 sample(const V8& p, Pair8 u) const;
  struct Beam8 {
    V8 wi;      ///< unit, to the environment
    V8 weight;  ///< radiance over the density per solid angle
  };
  /// Draws all light that comes, by how much does: what is brighter than the mean as `sample` does, the rest uniformly.
  Beam8 sample_all(Pair8 u) const;
  /// The density per solid angle of its directions.
  F8 all_pdf_solid_angle(const V8& direction) const;
  /// Density per solid angle with which `sample` draws unit directions.
  F8 pdf_solid_angle(const V8& direction) const;
  /// Luminance of the flux into a scene of this radius.
  double power(double scene_radius) const;
  std::uint64_t bytes() const;

  bool is_constant() const { return rgb_.empty(); }
  /// Calls `take` with unit directions all around, and with the irradiance that comes from the solid angle around each
  /// on a surface that faces it. Together they are the environment's light.
  using TakeBeam = std::function<void(const V8& direction, const V8& irradiance)>;
  void for_each_beam(const TakeBeam& take) const;

 private:
  /// The unit direction that is seen at a place of the image.
  V8 direction_of(F8 x, F8 sin_theta, F8 cos_theta) const;
  struct Place8 {
    F8 x, y;  ///< of the image, in [0, 1]
    F8 sin_theta;
  };
  Place8 place_of(const V8& direction) const;
  V8 lookup(F8 x, F8 y) const;
  std::vector<double> mean_luminance_of_pixels() const;

  bool there_ = false;
  Vec3 scale_{0};
  std::vector<float> rgb_;
  std::size_t width_ = 0, height_ = 0;
  float cos_turn_ = 1, sin_turn_ = 0;
  double mean_luminance_ = 0;  ///< over the sphere
  float bright_share_ = 0;     ///< of the light: of what is brighter than the mean, the excess; a multiple of 2^-24
  std::optional<PiecewiseConstant2D> density_;
};

}  // namespace lightmill
