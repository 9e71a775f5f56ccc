// Conversion of two GGX alphas, along u and along v, to a roughness and an anisotropy.
#pragma once

#include "common/scene/document/material.h"

namespace lightmill {

struct RoughAxes {
  double roughness = 0;  ///< √alpha across the direction of the anisotropy
  Anisotropy anisotropy = {};
};
/// The roughness and anisotropy of these alphas, each in [0, 1]. The conversion is exact. But if they differ, the
/// smaller one counts as kMinAnisotropicAlpha at least.
RoughAxes rough_axes(double alpha_u, double alpha_v);

}  // namespace lightmill
