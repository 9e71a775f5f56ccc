#include "common/scene_io/rough_axes.h"

#include <algorithm>
#include <cmath>

namespace lightmill {

RoughAxes rough_axes(double alpha_u, double alpha_v) {
  if (alpha_u == alpha_v) {
    return {std::sqrt(alpha_u), {}};
  }
  const double most = std::max(alpha_u, alpha_v);
  const double least = std::max(std::min(alpha_u, alpha_v), std::min(kMinAnisotropicAlpha, most));
  // most = least + (1 − least) strength²
  const double strength = least < 1 ? std::sqrt((most - least) / (1 - least)) : 0;
  return {std::sqrt(least), {strength, alpha_u < alpha_v ? 90.0 : 0.0}};
}

}  // namespace lightmill
