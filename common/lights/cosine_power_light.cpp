#include "common/lights/cosine_power_light.h"

#include "common/lights/photometry.h"
#include "common/math/exp_log.h"

namespace lightmill {

void CosinePowerLights::add(const CosinePowerEmitter& light) {
  points_.add(light.position, light.direction, light.intensity);
  exponent_.push_back(light.exponent);
}

LightBounds CosinePowerLights::bounds(std::size_t i) const {
  return points_.bounds(i, 1, 0, cosine_power_solid_angle(exponent_[i]));
}

IntensityShare8 CosinePowerLights::share(const V8& direction, U8 index, M8 lanes) const {
  const F8 cos_axis = dot(direction, points_.direction(index, lanes));
  return {pow(max(cos_axis, F8(0.0f)), gather(exponent_.data(), index, lanes)), cos_axis > F8(0.0f)};
}

LightSample8 CosinePowerLights::sample(const V8& p, U8 index, M8 lanes) const {
  const PointView8 view(p, points_.position(index, lanes), lanes);
  const IntensityShare8 there = share(view.direction(), index, lanes);
  return view.light(points_.intensity(index, lanes), there.share, there.lit);
}

V8 CosinePowerLights::intensity(const V8& direction, U8 index, M8 lanes) const {
  const IntensityShare8 there = share(direction, index, lanes);
  return points_.intensity(index, lanes) * masked(there.lit, there.share);
}

}  // namespace lightmill
