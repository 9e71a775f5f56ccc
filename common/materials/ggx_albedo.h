// Tabulated albedo of GGX surfaces, which says how much light is left for layers below.
#pragma once

#include <vector>

#include "common/math/vec.h"

namespace lightmill {

/// Directional albedos of GGX reflection (single scattering) with Schlick's Fresnel term F = f0 (1 − w) + f90 w, w = (1
/// − cos)⁵. They are linear in f0 and f90, so two tables over cos θ and roughness serve all materials. Rows are
/// interpolated linearly in √cos θ and √alpha. Values are raised by the largest interpolation error, so that a layer
/// with 1 − albedo never creates energy.
class GgxAlbedo {
 public:
  /// The only instance, made on first use (about 10 ms). Thread-safe.
  static const GgxAlbedo& instance();

  struct Terms8 {
    F8 normal;                                                          ///< albedo per f0
    F8 grazing;                                                         ///< albedo per f90
    F8 of(F8 f0, F8 f90) const { return f0 * normal + f90 * grazing; }  ///< at most 1 for f0, f90 <= 1
  };

  Terms8 directional(F8 cos_theta, F8 alpha) const;
  /// Mean of `directional` over the hemisphere, weighted by cos θ.
  Terms8 mean(F8 alpha) const;
  /// Minimum of `directional` over all angles, for f0 = 0.04 and f90 = 1.
  F8 least_coat(F8 alpha) const;

 private:
  GgxAlbedo();

  std::vector<float> normal_, grazing_;            ///< rows of √α, columns of √cos θ
  std::vector<float> mean_normal_, mean_grazing_;  ///< by √α
  std::vector<float> least_coat_;                  ///< by √α
};

}  // namespace lightmill
