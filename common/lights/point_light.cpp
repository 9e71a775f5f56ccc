#include "common/lights/point_light.h"

#include "common/lights/photometry.h"

namespace lightmill {

LightBounds PointLights::bounds(std::size_t i) const {
  const double intensity = luminance(Vec3d(intensity_[i]));
  return spherical_light_bounds(bounds_of_point(position_[i], kPointSolidAngle * intensity, intensity), radii_[i]);
}

LightSample8 PointLights::sample(const V8& p, U8 index, M8 lanes) const {
  return PointView8(p, position_.at(index, lanes), lanes).light(intensity_.at(index, lanes), F8(1.0f), lanes);
}

LightSample8 PointLights::sample(const V8& p, U8 index, M8 lanes, Pair8 u) const {
  return radii_.any() ? SphereSample8(p, position_.at(index, lanes), radii_.at(index, lanes), lanes, u)
                            .light(intensity_.at(index, lanes), F8(1.0f), lanes)
                      : sample(p, index, lanes);
}

Vec3d PointLights::irradiance(std::size_t i, const Vec3d& p, const Vec3d& n) const {
  return spherical_light_irradiance(Vec3d(intensity_[i]), Vec3d(position_[i]) - p, radii_[i], n);
}

}  // namespace lightmill
