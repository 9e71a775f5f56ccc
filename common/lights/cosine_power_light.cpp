#include "common/lights/cosine_power_light.h"

#include "common/lights/photometry.h"
#include "common/lights/point_light.h"
#include "common/math/exp_log.h"

namespace lightmill {

void CosinePowerLights::add(const CosinePowerEmitter& light) {
  points_.add(light.position, light.direction, light.intensity);
  exponent_.push_back(light.exponent);
}

LightBounds CosinePowerLights::bounds(std::size_t i) const {
  return points_.bounds(i, 0, cosine_power_solid_angle(exponent_[i]));
}

LightSample8 CosinePowerLights::sample(const V8& p, U8 index, M8 lanes) const {
  const PointView8 view(p, points_.position(index, lanes), lanes);
  const F8 cos_axis = -dot(view.wi, points_.direction(index, lanes));
  const F8 share = pow(max(cos_axis, F8(0.0f)), gather(exponent_.data(), index, lanes));
  return view.light(points_.intensity(index, lanes), share, cos_axis > F8(0.0f));
}

}  // namespace lightmill
