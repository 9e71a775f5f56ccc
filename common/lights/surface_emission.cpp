#include "common/lights/surface_emission.h"

#include "common/lights/photometry.h"
#include "common/math/exp_log.h"

namespace lightmill {

void SurfaceEmission::add(const Vec3& radiance, float exponent, bool two_sided) {
  radiance_.add(radiance);
  exponent_.push_back(exponent);
  two_sided_.push_back(two_sided ? 1 : 0);
  any_two_sided_ |= two_sided;
  has_exponents_ |= exponent != 0;
}

F8 SurfaceEmission::share(U8 index, F8 cos_light, M8 lanes) const {
  return pow(cos_light, gather(exponent_.data(), index, lanes));
}

double SurfaceEmission::exitance(std::size_t i, const Vec3d& radiance) const {
  return luminance(radiance) * exitance_per_radiance(exponent_[i]) * (two_sided_[i] + 1);
}

}  // namespace lightmill
