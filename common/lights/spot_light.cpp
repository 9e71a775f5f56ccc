#include "common/lights/spot_light.h"

#include "common/lights/photometry.h"

namespace lightmill {

void SpotLights::add(const SpotEmitter& spot) {
  points_.add(spot.position, spot.direction, spot.intensity);
  inner_.push_back(spot.inner);
  outer_.push_back(spot.outer);
  radii_.add(spot.radius);
}

LightBounds SpotLights::bounds(std::size_t i) const {
  return spherical_light_bounds(points_.bounds(i, 1.0 - outer_[i], 1, spot_solid_angle(inner_[i], outer_[i])),
                                radii_[i]);
}

IntensityShare8 SpotLights::share(const V8& direction, U8 index, M8 lanes) const {
  // 1 − cos. Rounding must not exceed its largest value, 2.
  const F8 off_axis = min(length_squared(points_.direction(index, lanes) - direction) * F8(0.5f), F8(2.0f));
  const F8 inner = gather(inner_.data(), index, lanes);
  const F8 outer = gather(outer_.data(), index, lanes);
  // If both cones are equal, t is infinite inside and NaN at the rim. `min` and `max` make both 1.
  const F8 t = max(min((outer - off_axis) / (outer - inner), F8(1.0f)), F8(0.0f));
  return {select(off_axis <= inner, F8(1.0f), t * t * (F8(3.0f) - F8(2.0f) * t)),
          (off_axis < outer) | (outer >= F8(2.0f))};
}

LightSample8 SpotLights::sample(const V8& p, U8 index, M8 lanes) const {
  const PointView8 view(p, points_.position(index, lanes), lanes);
  const IntensityShare8 there = share(view.direction(), index, lanes);
  return view.light(points_.intensity(index, lanes), there.share, there.lit);
}

LightSample8 SpotLights::sample(const V8& p, U8 index, M8 lanes, Pair8 u) const {
  if (!radii_.any()) {
    return sample(p, index, lanes);
  }
  const SphereSample8 sphere(p, points_.position(index, lanes), radii_.at(index, lanes), lanes, u);
  const IntensityShare8 there = share(sphere.direction(), index, lanes);
  return sphere.light(points_.intensity(index, lanes), there.share, there.lit);
}

Vec3d SpotLights::irradiance(std::size_t i, const Vec3d& p, const Vec3d& n) const {
  const U8 index(static_cast<std::uint32_t>(i));
  const M8 all(true);
  const Vec3d to_center = VectorLanes(points_.position(index, all))[0] - p;
  const V8 direction = broadcast(Vec3(-glm::normalize(to_center)));
  return spherical_light_irradiance(VectorLanes(intensity(direction, index, all))[0], to_center, radii_[i], n);
}

V8 SpotLights::intensity(const V8& direction, U8 index, M8 lanes) const {
  const IntensityShare8 there = share(direction, index, lanes);
  return points_.intensity(index, lanes) * masked(there.lit, there.share);
}

}  // namespace lightmill
