#include "common/lights/spot_light.h"

#include "common/lights/photometry.h"
#include "common/lights/point_light.h"

namespace lightmill {

void SpotLights::add(const SpotEmitter& spot) {
  position_.add(spot.position);
  direction_.add(spot.direction);
  intensity_.add(spot.intensity);
  inner_.push_back(spot.inner);
  outer_.push_back(spot.outer);
}

LightBounds SpotLights::bounds(std::size_t i) const {
  LightBounds b;
  b.low = b.high = Vec3d(position_[i]);
  b.axis = Vec3d(direction_[i]);
  b.cos_normals = 1;
  b.cos_emission = std::min(1.0 - outer_[i], 0.0);
  b.power = spot_solid_angle(inner_[i], outer_[i]) * luminance(Vec3d(intensity_[i]));
  return b;
}

LightSample8 SpotLights::sample(const V8& p, U8 index, M8 lanes) const {
  const V8 position = position_.at(index, lanes);
  const PointView8 view(p, position, lanes);
  const F8 off_axis = length_squared(view.wi + direction_.at(index, lanes)) * F8(0.5f);  // 1 − cos
  const F8 inner = gather(inner_.data(), index, lanes);
  const F8 outer = gather(outer_.data(), index, lanes);
  // Without a falling part t is infinite inside, or no number at the rim, which `min` and `max` make 1.
  const F8 t = max(min((outer - off_axis) / (outer - inner), F8(1.0f)), F8(0.0f));
  const F8 share = select(off_axis <= inner, F8(1.0f), t * t * (F8(3.0f) - F8(2.0f) * t));
  const M8 valid = view.valid & (off_axis < outer);
  return {position, view.wi, intensity_.at(index, lanes) * (share / view.distance2), F8(0.0f), valid};
}

}  // namespace lightmill
