#include "common/lights/cosine_power_light.h"

#include "common/lights/photometry.h"
#include "common/lights/point_light.h"
#include "common/math/exp_log.h"

namespace lightmill {

void CosinePowerLights::add(const CosinePowerEmitter& light) {
  position_.add(light.position);
  direction_.add(light.direction);
  intensity_.add(light.intensity);
  exponent_.push_back(light.exponent);
}

LightBounds CosinePowerLights::bounds(std::size_t i) const {
  LightBounds b;
  b.low = b.high = Vec3d(position_[i]);
  b.axis = Vec3d(direction_[i]);
  b.cos_normals = 1;
  b.cos_emission = 0;
  b.power = cosine_power_solid_angle(exponent_[i]) * luminance(Vec3d(intensity_[i]));
  return b;
}

LightSample8 CosinePowerLights::sample(const V8& p, U8 index, M8 lanes) const {
  const V8 position = position_.at(index, lanes);
  const PointView8 view(p, position, lanes);
  const F8 cos_axis = -dot(view.wi, direction_.at(index, lanes));
  const F8 share = pow(max(cos_axis, F8(0.0f)), gather(exponent_.data(), index, lanes));
  const M8 valid = view.valid & (cos_axis > F8(0.0f));
  return {position, view.wi, intensity_.at(index, lanes) * (share / view.distance2), F8(0.0f), valid};
}

}  // namespace lightmill
