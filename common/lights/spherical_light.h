// Spherical lights: the shape of point lights and spots with a radius.
//
// A point light of intensity I(ω) and radius r is a sphere whose surface has the radiance I(ω)/(π r²) in each outward
// direction ω. Its projected area is π r² from everywhere, so its intensity from afar is I(ω). Its inside is dark.
#pragma once

#include "common/lights/closed_form_irradiance.h"
#include "common/lights/light_sample.h"
#include "common/lights/sphere_view.h"

namespace lightmill {

/// The radii of the lights of a kind; 0 for points.
class SphereRadii {
 public:
  void add(float radius) {
    radius_.push_back(radius);
    any_ |= radius > 0;
  }
  bool any() const { return any_; }
  float operator[](std::size_t i) const { return radius_[i]; }
  F8 at(U8 index, M8 lanes) const { return any_ ? gather(radius_.data(), index, lanes) : F8(0.0f); }

 private:
  std::vector<float> radius_;
  bool any_ = false;
};

/// A sphere counts as a point if the squared sine of its half angle is smaller.
inline constexpr float kMinSphereSine2 = 1e-20f;

/// A sampled point of spheres as seen from p, uniform in the cone that they subtend. Spheres of radius 0 are points.
struct SphereSample8 {
  V8 position;
  V8 wi;
  F8 irradiance;       ///< over the intensity towards p, on a surface that faces the sample
  F8 pdf_solid_angle;  ///< 0 for points
  M8 valid;
  SphereSample8(const V8& p, const V8& center, F8 radius, M8 lanes, Pair8 u) {
    const SphereView8 view(p, center, radius);
    const M8 sphere = is_sphere(view, radius);
    const SphereView8::Entry8 entry = view.sample(radius, u);
    wi = select(sphere, entry.wi, view.to_center * (F8(1.0f) / sqrt(view.center2)));
    position = select(sphere, center + entry.normal * radius, center);
    irradiance = F8(2.0f) / (view.center2 * (F8(1.0f) + view.cos_max));  // 2(1 − cos)/r², the solid angle over π r²
    pdf_solid_angle = masked(sphere, cone_pdf_solid_angle(view.one_minus_cos));
    valid = lanes & view.outside & (view.center2 > F8(0.0f));
  }
  /// Unit direction of travel, to p.
  V8 direction() const { return -wi; }
  LightSample8 light(const V8& intensity, F8 share, M8 lit) const {
    return {position, wi, intensity * (share * irradiance), pdf_solid_angle, valid & lit};
  }
  static M8 is_sphere(const SphereView8& view, F8 radius) {
    return (radius * radius > view.center2 * F8(kMinSphereSine2)) & view.outside;
  }
};

/// Density per solid angle of these samples; 0 for points, and from inside.
inline F8 spherical_light_pdf_solid_angle(const V8& from, const V8& center, F8 radius) {
  const SphereView8 view(from, center, radius);
  return masked(SphereSample8::is_sphere(view, radius), cone_pdf_solid_angle(view.one_minus_cos));
}

/// Where rays from outside, with unit directions, enter spheres.
struct SphereEntry8 {
  M8 hit;
  F8 distance;
  F8 cosine;  ///< to the sphere's surface
  SphereEntry8(const V8& origin, const V8& direction, const V8& center, F8 radius, M8 lanes) {
    const V8 to_center = center - origin;
    const F8 along = dot(to_center, direction), radius2 = radius * radius;
    const F8 half2 = radius2 - length_squared(to_center - direction * along);
    const F8 half = sqrt(max(half2, F8(0.0f)));
    hit = lanes & (half2 > F8(0.0f)) & (along > F8(0.0f)) & (length_squared(to_center) > radius2);
    distance = along - half;
    cosine = half / radius;
  }
};

/// The point of spheres with this outward unit normal. Its `area` is that of the whole sphere. For point lights only
/// the position has a meaning.
inline EmissionPoint8 sphere_emission_point(const V8& center, F8 radius, M8 lanes, const V8& outward) {
  EmissionPoint8 out{};
  out.point = center + outward * radius;
  out.normal = outward;
  out.area = F8(4 * kPi) * radius * radius;
  out.texture = broadcast(Vec3(1));
  out.surface = lanes & (radius > F8(0.0f));
  return out;
}

/// Irradiance of a sphere of uniform intensity on a surface with unit normal n, without occlusion.
inline Vec3d spherical_light_irradiance(const Vec3d& intensity, const Vec3d& to_center, double radius, const Vec3d& n) {
  return glm::length(to_center) > radius
             ? intensity * (sphere_irradiance(to_center, radius, n) / (kPiDouble * radius * radius))
             : Vec3d(0);
}

/// Bounds of a point with this radius.
inline LightBounds spherical_light_bounds(LightBounds point, double radius) {
  point.low -= radius;
  point.high += radius;
  return point;
}

}  // namespace lightmill
