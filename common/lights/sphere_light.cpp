#include "common/lights/sphere_light.h"

#include <cmath>

#include "common/lights/closed_form_irradiance.h"
#include "common/lights/photometry.h"
#include "common/lights/sphere_view.h"
#include "common/math/transcendental.h"

namespace lightmill {
namespace {

/// Distance from a sphere's surface for rays that come from this distance or start at y. Embree finds a distant sphere
/// to about 3e-6 of the distance, which is well below.
F8 off_sphere(const V8& y, F8 distance) {
  return F8(0x1p-16f) * (max_component(abs(y)) + distance);
}

F8 density(const SphereView8& view, F8 radius, F8 distance, F8 cos_light) {
  const F8 area = distance * distance / (cos_light * F8(4 * kPi) * radius * radius);
  return select(view.outside, cone_pdf_solid_angle(view.one_minus_cos), area);
}

}  // namespace

void SphereLights::add(const EmissiveSphere& sphere) {
  center_.add(sphere.center);
  emission_.add(sphere.radiance, sphere.exponent, sphere.two_sided);
  radius_.push_back(sphere.radius);
  inward_.push_back(sphere.inward ? 1 : 0);
}

LightBounds SphereLights::bounds(std::size_t i) const {
  const Vec3d center(center_[i]);
  const double radius = radius_[i];
  LightBounds b;
  b.low = center - Vec3d(radius);
  b.high = center + Vec3d(radius);
  b.power = emission_.exitance(i) * 4 * kPiDouble * radius * radius;
  b.intensity =
      luminance(Vec3d(emission_.radiance(i))) * exitance_per_radiance(emission_.exponent(i)) * radius * radius;
  return b;
}

LightSample8 SphereLights::sample(const V8& p, U8 index, M8 lanes, Pair8 u) const {
  const V8 center = center_.at(index, lanes);
  const F8 radius = gather(radius_.data(), index, lanes);
  const M8 inward = gather(inward_.data(), index, lanes) == U8(1u);
  const M8 two_sided = emission_.two_sided(index, lanes);

  // From outside: a direction in the cone that the sphere subtends, and the point where it enters.
  const SphereView8 view(p, center, radius);
  const SphereView8::Entry8 entry = view.sample(radius, u);

  // From inside: a point uniform by area.
  const V8 normal = select(view.outside, entry.normal, square_to_sphere(u));
  const V8 y = center + normal * radius;
  const V8 to_light = y - p;
  const F8 distance2 = length_squared(to_light);
  const F8 distance = sqrt(distance2);
  const V8 wi = select(view.outside, entry.wi, to_light * (F8(1.0f) / distance));

  const F8 cos_outward = -dot(wi, normal);  // positive if the outer side is visible
  const F8 cos_emitting = select(inward, -cos_outward, cos_outward);
  const F8 cos_light = select(two_sided, abs(cos_outward), cos_emitting);
  const M8 valid = lanes & (cos_light > F8(0.0f)) & (distance2 > F8(0.0f));

  const F8 pdf = density(view, radius, distance, cos_light);
  const V8 radiance = emission_.radiance(index, cos_light, lanes);
  const V8 off = normal * copysign(off_sphere(y, distance), cos_outward);
  return {y + off, wi, radiance * (F8(1.0f) / pdf), pdf, valid};
}

EmissionPoint8 SphereLights::emission_point(U8 index, M8 lanes, const V8& outward) const {
  const F8 radius = gather(radius_.data(), index, lanes);
  const M8 inward = gather(inward_.data(), index, lanes) == U8(1u);
  EmissionPoint8 out;
  out.point = center_.at(index, lanes) + outward * radius;
  out.normal = select(inward, -outward, outward);
  out.offset = off_sphere(out.point, radius);
  out.area = F8(4 * kPi) * radius * radius;
  out.texture = broadcast(Vec3(1));
  out.surface = lanes;
  out.two_sided = emission_.two_sided(index, lanes);
  return out;
}

bool SphereLights::can_reach(std::size_t i, const Vec3d& center, double radius) const {
  return inward_[i] == 1 || emission_.two_sided(i) || glm::length(center - Vec3d(center_[i])) + radius > radius_[i];
}

Vec3d SphereLights::irradiance(std::size_t i, const Vec3d& p, const Vec3d& n) const {
  const Vec3d to_center = Vec3d(center_[i]) - p;
  const double distance = glm::length(to_center);
  const Vec3d radiance(emission_.radiance(i));
  if (distance <= radius_[i]) {
    return inward_[i] == 1 || emission_.two_sided(i) ? radiance * kPiDouble : Vec3d(0);
  }
  if (inward_[i] == 1 && !emission_.two_sided(i)) {
    return Vec3d(0);
  }
  return radiance * sphere_irradiance(to_center, radius_[i], n);
}

F8 SphereLights::pdf_solid_angle(const V8& from, U8 index, F8 distance, F8 cos_light, M8 lanes) const {
  const F8 radius = gather(radius_.data(), index, lanes);
  return density(SphereView8(from, center_.at(index, lanes), radius), radius, distance, cos_light);
}

}  // namespace lightmill
