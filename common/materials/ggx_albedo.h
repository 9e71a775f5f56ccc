// How much light a GGX surface reflects in all, tabulated: what layers below it may still have.
#pragma once

#include <vector>

#include "common/math/vec.h"

namespace lightmill {

/// Directional albedos of GGX reflection (single scattering) for Schlick's Fresnel term
/// F = f0 (1 − w) + f90 w, w = (1 − cos)⁵: they are linear in f0 and f90, so two tables over cos θ and roughness serve
/// all materials. Rows are interpolated linearly in √cos θ and √α, and lifted by as much as interpolation may be low: a
/// layer that is given 1 − albedo never makes energy.
class GgxAlbedo {
 public:
  /// The one table, made when it is first asked for (some 10 ms); thread-safe.
  static const GgxAlbedo& instance();

  struct Terms8 {
    F8 normal;                                                          ///< albedo per f0
    F8 grazing;                                                         ///< albedo per f90
    F8 of(F8 f0, F8 f90) const { return f0 * normal + f90 * grazing; }  ///< at most 1 for f0, f90 <= 1
  };

  Terms8 directional(F8 cos_theta, F8 alpha) const;
  /// The mean over the hemisphere, weighted with cos θ, of what `directional` gives.
  Terms8 mean(F8 alpha) const;
  /// The least of `directional` over all angles, for f0 = 0.04 and f90 = 1.
  F8 least_coat(F8 alpha) const;

 private:
  GgxAlbedo();

  std::vector<float> normal_, grazing_;            ///< rows of √α, columns of √cos θ
  std::vector<float> mean_normal_, mean_grazing_;  ///< by √α
  std::vector<float> least_coat_;                  ///< by √α
};

}  // namespace lightmill
