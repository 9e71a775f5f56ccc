#include "common/lights/point_light.h"

#include "common/lights/photometry.h"

namespace lightmill {

LightBounds PointLights::bounds(std::size_t i) const {
  LightBounds b;
  b.low = b.high = Vec3d(position_[i]);
  b.power = kPointSolidAngle * luminance(Vec3d(intensity_[i]));
  return b;
}

LightSample8 PointLights::sample(const V8& p, U8 index, M8 lanes) const {
  const V8 position = position_.at(index, lanes);
  const PointView8 view(p, position, lanes);
  return {position, view.wi, intensity_.at(index, lanes) * (F8(1.0f) / view.distance2), F8(0.0f), view.valid};
}

}  // namespace lightmill
