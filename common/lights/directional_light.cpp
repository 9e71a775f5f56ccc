#include "common/lights/directional_light.h"

#include "common/lights/photometry.h"

namespace lightmill {

double DirectionalLights::power(std::size_t i, double scene_radius) const {
  return luminance(Vec3d(irradiance_[i])) * kPiDouble * scene_radius * scene_radius;
}

LightSample8 DirectionalLights::sample(const V8& p, U8 index, M8 lanes) const {
  const V8 wi = -direction_.at(index, lanes);
  return {p + wi * F8(kFarAway), wi, irradiance_.at(index, lanes), F8(0.0f), lanes};
}

}  // namespace lightmill
