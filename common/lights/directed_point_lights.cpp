#include "common/lights/directed_point_lights.h"

#include "common/lights/photometry.h"
#include "common/lights/point_light.h"

namespace lightmill {

void DirectedPointLights::add(const Vec3& position, const Vec3& direction, const Vec3& intensity) {
  position_.add(position);
  direction_.add(direction);
  intensity_.add(intensity);
}

LightBounds DirectedPointLights::bounds(std::size_t i, double cos_normals, double cos_emission,
                                        double solid_angle) const {
  const double intensity = luminance(Vec3d(intensity_[i]));
  LightBounds b = bounds_of_point(position_[i], solid_angle * intensity, intensity);
  b.axis = Vec3d(direction_[i]);
  b.cos_normals = cos_normals;
  b.cos_emission = cos_emission;
  return b;
}

}  // namespace lightmill
