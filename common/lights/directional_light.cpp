#include "common/lights/directional_light.h"

#include "common/lights/photometry.h"

namespace lightmill {

DistantBounds DirectionalLights::bounds(std::size_t i) const {
  return {luminance(Vec3d(irradiance_[i])), -Vec3d(direction_[i]), 0};
}

LightSample8 DirectionalLights::sample(const V8& p, U8 index, M8 lanes) const {
  const V8 wi = -direction_.at(index, lanes);
  return {p + wi * F8(kFarAway), wi, irradiance_.at(index, lanes), F8(0.0f), lanes};
}

}  // namespace lightmill
