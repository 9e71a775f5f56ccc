// Rough surfaces with two alphas, as other renderers have them.
#pragma once

#include "common/scene/document/material.h"

namespace lightmill {

struct RoughAxes {
  double roughness = 0;  ///< √alpha across the direction of the anisotropy
  Anisotropy anisotropy = {};
};
/// GGX with these alphas along u and along v, each in [0, 1]. It is exact, but the smaller alpha of two that differ is at
/// least kLeastAnisotropicAlpha.
RoughAxes rough_axes(double alpha_u, double alpha_v);

}  // namespace lightmill
