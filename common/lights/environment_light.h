// Environment light: infinitely distant light from all directions, of one colour or of an image.
#pragma once

#include <array>
#include <functional>
#include <optional>
#include <vector>

#include "common/lights/light_sample.h"
#include "common/sampling/piecewise_2d.h"

namespace lightmill {

/// Which direction each place of an image shows.
enum class EnvironmentMapping {
  /// Columns are longitudes: the centre is towards +x, and right turns towards +z. Rows are latitudes: the top is +y.
  /// Values are radiances at pixel centres, bilinear between them. Columns wrap around. Rows are constant beyond the
  /// centres of the first and last.
  equirectangular,
  /// A square, on which equal areas are equal solid angles (Clarberg 2008, "Fast Equal-Area Mapping of the
  /// (Hemi)Sphere using SIMD"). The centre is +z, the corners are −z, the middle of the right side is +x, and that of
  /// the bottom +y. Each pixel has one radiance, as in pbrt.
  equal_area,
};

struct EnvironmentImage {
  std::vector<float> rgb = {};  ///< interleaved, row by row, finite and not negative; fewer than 2^29 pixels
  std::size_t width = 0, height = 0;
  EnvironmentMapping mapping = EnvironmentMapping::equirectangular;
  /// Rows of an orthogonal matrix, from directions of the scene to those of the image; none: the identity.
  std::optional<std::array<Vec3d, 3>> orientation = {};
  double rotation_degrees = 0;  ///< after it, about the image's +y, from +x towards −z
};

class EnvironmentRadiance {
 public:
  /// No environment.
  EnvironmentRadiance() = default;
  /// Constant radiance in W/(m² sr).
  explicit EnvironmentRadiance(const Vec3& radiance) : there_(true), scale_(radiance) {}
  /// Radiance is the image's value times `scale`.
  EnvironmentRadiance(EnvironmentImage image, const Vec3& scale);

  bool exists() const { return there_; }
  /// Radiance from these unit directions.
  V8 radiance(const V8& direction) const;
  /// Mean over all directions. Of an image it is the mean over its pixels, which takes time.
  Vec3d mean_radiance() const;

  /// Whether `sample` draws anything. It draws only directions brighter than the mean (Karlík et al. 2019, "MIS
  /// Compensation"). Scattered rays find the rest, and all of a constant environment.
  bool samplable() const { return density_.has_value(); }
  LightSample8 sample(const V8& p, Pair8 u) const;
  struct Beam8 {
    V8 wi;      ///< unit, to the environment
    V8 weight;  ///< radiance over the density per solid angle
  };
  /// Draws from all of the light, in proportion to it: the excess over the mean as `sample` does, the rest uniformly.
  Beam8 sample_all(Pair8 u) const;
  /// Density per solid angle of the directions of `sample_all`.
  F8 all_pdf_solid_angle(const V8& direction) const;
  /// Density per solid angle of the directions of `sample`.
  F8 pdf_solid_angle(const V8& direction) const;
  /// Luminance of the integral of radiance over all directions.
  double irradiance() const;
  std::uint64_t bytes() const;

  bool is_constant() const { return rgb_.empty(); }
  /// Calls `take` with unit directions that cover the sphere, and with the irradiance from the solid angle around each,
  /// on a surface that faces it. Together they are the environment's light.
  using TakeBeam = std::function<void(const V8& direction, const V8& irradiance)>;
  void for_each_beam(const TakeBeam& take) const;

 private:
  struct Place8 {
    F8 x, y;         ///< in the image, in [0, 1]
    F8 solid_angle;  ///< around it, over the share of the image's area
  };
  Place8 place_of(const V8& direction) const;
  struct Direction8 {
    V8 unit;
    F8 solid_angle;  ///< as in Place8
  };
  Direction8 direction_of(F8 x, F8 y) const;
  V8 to_image(const V8& direction) const;
  V8 from_image(const V8& direction) const;
  V8 lookup(F8 x, F8 y) const;
  V8 lookup_nearest(F8 x, F8 y) const;
  std::vector<double> mean_luminance_of_pixels() const;
  std::vector<double> pixel_solid_angles(std::size_t width, std::size_t height) const;

  bool there_ = false;
  Vec3 scale_{0};
  std::vector<float> rgb_;
  std::size_t width_ = 0, height_ = 0;
  EnvironmentMapping mapping_ = EnvironmentMapping::equirectangular;
  float cos_turn_ = 1, sin_turn_ = 0;
  std::optional<std::array<Vec3, 3>> rows_;  ///< of the orientation and the rotation together; none: only the rotation
  double mean_luminance_ = 0;                ///< over the sphere
  float bright_share_ = 0;                   ///< share of the light that exceeds the mean; a multiple of 2^-24
  std::optional<PiecewiseConstant2D> density_;
};

}  // namespace lightmill
