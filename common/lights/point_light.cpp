#include "common/lights/point_light.h"

#include "common/lights/photometry.h"

namespace lightmill {

LightBounds PointLights::bounds(std::size_t i) const {
  const double intensity = luminance(Vec3d(intensity_[i]));
  return bounds_of_point(position_[i], kPointSolidAngle * intensity, intensity);
}

LightSample8 PointLights::sample(const V8& p, U8 index, M8 lanes) const {
  return PointView8(p, position_.at(index, lanes), lanes).light(intensity_.at(index, lanes), F8(1.0f), lanes);
}

}  // namespace lightmill
