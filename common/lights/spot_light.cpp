#include "common/lights/spot_light.h"

#include "common/lights/photometry.h"
#include "common/lights/point_light.h"

namespace lightmill {

void SpotLights::add(const SpotEmitter& spot) {
  position_.add(spot.position);
  direction_.add(spot.direction);
  intensity_.add(spot.intensity);
  cos_inner_.push_back(spot.cos_inner);
  cos_outer_.push_back(spot.cos_outer);
}

LightBounds SpotLights::bounds(std::size_t i) const {
  LightBounds b;
  b.low = b.high = Vec3d(position_[i]);
  b.axis = Vec3d(direction_[i]);
  b.cos_normals = 1;
  b.cos_emission = std::min<double>(cos_outer_[i], 0);
  b.power = spot_solid_angle(cos_inner_[i], cos_outer_[i]) * luminance(Vec3d(intensity_[i]));
  return b;
}

LightSample8 SpotLights::sample(const V8& p, U8 index, M8 lanes) const {
  const V8 position = position_.at(index, lanes);
  const PointView8 view(p, position, lanes);
  const F8 cos_axis = -dot(view.wi, direction_.at(index, lanes));
  const F8 inner = gather(cos_inner_.data(), index, lanes);
  const F8 outer = gather(cos_outer_.data(), index, lanes);
  // Without a falling part t is infinite inside, or no number at the rim, which `min` and `max` make 1.
  const F8 t = max(min((cos_axis - outer) / (inner - outer), F8(1.0f)), F8(0.0f));
  const F8 share = select(cos_axis >= inner, F8(1.0f), t * t * (F8(3.0f) - F8(2.0f) * t));
  const M8 valid = view.valid & (cos_axis > outer);
  return {position, view.wi, intensity_.at(index, lanes) * (share / view.distance2), F8(0.0f), valid};
}

}  // namespace lightmill
