#include "common/scene/document/subsurface.h"

#include <algorithm>
#include <cmath>

namespace lightmill {

double scattering_albedo(double color, double anisotropy) {
  const double root = std::sqrt(9.59217 + 41.6808 * color + 17.7126 * color * color);
  const double s = std::clamp(4.09712 + 4.20863 * color - root, 0.0, 1.0);  // √((1 − α)/(1 − αg))
  return (1 - s * s) / (1 - anisotropy * s * s);
}

double returned_share(double albedo, double anisotropy) {
  const double s = std::sqrt((1 - albedo) / (1 - albedo * anisotropy));
  return (1 - s) * (1 - 0.139 * s) / (1 + 1.17 * s);
}

Medium subsurface_medium(const RgbColor& color, const RgbColor& radius, double anisotropy) {
  Medium out;
  out.anisotropy = anisotropy;
  for (const auto channel : {&RgbColor::r, &RgbColor::g, &RgbColor::b}) {
    const double extinction = std::min(1 / (double{radius.*channel} * (1 - anisotropy)), kMaxAbsorption);
    const double scattering = extinction * scattering_albedo(color.*channel, anisotropy);
    out.scattering.*channel = static_cast<float>(scattering);
    out.absorption.*channel = static_cast<float>(extinction - scattering);
  }
  return out;
}

}  // namespace lightmill
