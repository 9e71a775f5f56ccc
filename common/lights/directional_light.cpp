#include "common/lights/directional_light.h"

#include <algorithm>
#include <cmath>

#include "common/lights/closed_form_irradiance.h"
#include "common/lights/photometry.h"

namespace lightmill {

void DirectionalLights::add(const DirectionalEmitter& light) {
  direction_.add(light.direction);
  irradiance_.add(light.irradiance);
  one_minus_cos_.push_back(light.one_minus_cos);
  has_disks_ |= light.one_minus_cos > 0;
}

DistantBounds DirectionalLights::bounds(std::size_t i) const {
  const double c = one_minus_cos_[i];
  return {luminance(Vec3d(irradiance_[i])), -Vec3d(direction_[i]), std::sqrt(c * (2 - c))};
}

LightSample8 DirectionalLights::sample(const V8& p, U8 index, M8 lanes) const {
  const V8 wi = -direction_.at(index, lanes);
  return {p + wi * F8(kFarAway), wi, irradiance_.at(index, lanes), F8(0.0f), lanes};
}

LightSample8 DirectionalLights::sample(const V8& p, U8 index, M8 lanes, Pair8 u) const {
  LightSample8 out = sample(p, index, lanes);
  if (has_disks_) {
    const F8 angle = gather_row(one_minus_cos_, index, lanes);
    const M8 disk = angle > F8(0.0f);
    const V8 wi = select(disk, Frame8(out.wi).to_world(square_to_cone(u, angle)), out.wi);
    // Radiance E/(π sin²) over the density 1/(2π(1 − cos)), with sin² = (1 − cos)(1 + cos).
    const F8 share = select(disk, F8(2.0f) / (F8(2.0f) - angle), F8(1.0f));
    out = {p + wi * F8(kFarAway), wi, out.weight * share, masked(disk, cone_pdf_solid_angle(angle)), lanes};
  }
  return out;
}

F8 DirectionalLights::pdf_solid_angle(const V8& to_light, U8 index, M8 lanes) const {
  const F8 angle = gather_row(one_minus_cos_, index, lanes);
  const F8 off_axis = length_squared(to_light + direction_.at(index, lanes)) * F8(0.5f);  // 1 − cos
  return masked((angle > F8(0.0f)) & (off_axis <= angle), cone_pdf_solid_angle(angle));
}

V8 DirectionalLights::radiance(U8 index, M8 lanes) const {
  const F8 angle = gather_row(one_minus_cos_, index, lanes);
  return irradiance_.at(index, lanes) * (F8(kInvPi) / (angle * (F8(2.0f) - angle)));
}

/// That of a sphere at distance 1 which fills the disk.
Vec3d DirectionalLights::irradiance(std::size_t i, const Vec3d& /*p*/, const Vec3d& n) const {
  const double radius = bounds(i).radius;
  const Vec3d to_light = -Vec3d(direction_[i]), facing(irradiance_[i]);
  return radius > 0 ? facing * (sphere_irradiance(to_light, radius, n) / (kPiDouble * radius * radius))
                    : facing * std::max(glm::dot(to_light, n), 0.0);
}

}  // namespace lightmill
