#include "common/lights/sphere_light.h"

#include <algorithm>
#include <cmath>

#include "common/lights/photometry.h"
#include "common/lights/sphere_irradiance.h"
#include "common/math/transcendental.h"

namespace lightmill {
namespace {

/// A sphere as seen from p.
struct View8 {
  V8 to_center;
  F8 center2;        ///< squared distance of the centre
  M8 outside;        ///< p is outside
  F8 one_minus_cos;  ///< 1 − cosθmax of the cone that the sphere subtends, if outside
  View8(const V8& p, const V8& center, F8 radius) : to_center(center - p), center2(length_squared(to_center)) {
    const F8 sin2_max = radius * radius / center2;
    outside = sin2_max < F8(1.0f);
    const F8 cos_max = sqrt(max(F8(1.0f) - sin2_max, F8(0.0f)));
    one_minus_cos = sin2_max / (F8(1.0f) + cos_max);
  }
};

/// Distance from a sphere's surface for rays that come from this distance or start at y. Embree finds a distant sphere
/// to about 3e-6 of the distance, which is well below.
F8 off_sphere(const V8& y, F8 distance) {
  return F8(0x1p-16f) * (max_component(abs(y)) + distance);
}

F8 density(const View8& view, F8 radius, F8 distance, F8 cos_light) {
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
  const View8 view(p, center, radius);
  const V8 local = square_to_cone(u, view.one_minus_cos);
  const F8 center_distance = sqrt(view.center2);
  const Frame8 cone(view.to_center * (F8(1.0f) / center_distance));
  const V8 cone_wi = cone.to_world(local);
  const F8 sin2 = local.x * local.x + local.y * local.y;  // 1 − z² would cancel for small solid angles
  const F8 entry = center_distance * local.z - sqrt(max(radius * radius - view.center2 * sin2, F8(0.0f)));
  // The entry relative to the centre. It is accurate also if the sphere is smaller than the coordinates' precision.
  const F8 aside = entry / radius;
  const F8 nx = local.x * aside, ny = local.y * aside;
  const V8 cone_normal = cone.to_world({nx, ny, -sqrt(max(F8(1.0f) - nx * nx - ny * ny, F8(0.0f)))});

  // From inside: a point uniform by area.
  const V8 normal = select(view.outside, cone_normal, square_to_sphere(u));
  const V8 y = center + normal * radius;
  const V8 to_light = y - p;
  const F8 distance2 = length_squared(to_light);
  const F8 distance = sqrt(distance2);
  const V8 wi = select(view.outside, cone_wi, to_light * (F8(1.0f) / distance));

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
  return density(View8(from, center_.at(index, lanes), radius), radius, distance, cos_light);
}

}  // namespace lightmill
