#include "common/lights/photon_aim.h"

#include <cmath>

#include "common/base/check.h"
#include "common/sampling/warp.h"

namespace lightmill {
namespace {

/// Spheres are enlarged by this share of their radius, of their distance from the origin and of the scene's radius.
/// Rounding can put their points outside.
constexpr double kMargin = 0x1p-20;
/// Smallest cap in which normals are drawn, as cosine.
constexpr float kMaxCapCosine = 1 - 0x1p-12f;

/// Cosine-distributed directions on the emitting sides.
V8 around_surface(const EmissionPoint8& from, Pair8 u) {
  const F8 turned = u.u + u.u;
  const M8 back = from.two_sided & (turned >= F8(1.0f));
  u.u = select(from.two_sided, select(back, turned - F8(1.0f), turned), u.u);
  const V8 d = Frame8(from.normal).to_world(square_to_cosine_hemisphere(u));
  return select(back, -d, d);
}

F8 around_surface_pdf_solid_angle(const EmissionPoint8& from, const V8& direction) {
  const F8 cosine = dot(direction, from.normal);
  const F8 sides = select(from.two_sided, F8(0.5f), F8(1.0f));
  return cosine_hemisphere_pdf_solid_angle(select(from.two_sided, abs(cosine), cosine)) * sides;
}

}  // namespace

PhotonAim::PhotonAim(std::vector<BoundingSphere> targets, const BoundingSphere& scene) {
  LM_CHECK(targets.size() <= kMaxPhotonTargets);
  for (const BoundingSphere& t : targets) {
    const bool all = !std::isfinite(t.radius);
    const BoundingSphere& s = all ? scene : t;
    const double margin = (s.radius + glm::length(s.center) + scene.radius) * kMargin;
    targets_.push_back({Vec3(s.center), static_cast<float>(s.radius + margin), all});
  }
}

PhotonAim::Cone8 PhotonAim::cone(const Target& target, const V8& p) const {
  const V8 to_center = broadcast(target.center) - p;
  const F8 center2 = length_squared(to_center);
  const F8 sin2 = F8(target.radius) * F8(target.radius) / center2;
  const M8 outside = sin2 < F8(1.0f);
  const F8 cos_max = sqrt(max(F8(1.0f) - sin2, F8(0.0f)));
  return {to_center * (F8(1.0f) / sqrt(center2)), sin2 / (F8(1.0f) + cos_max), target.all ? M8(true) : ~outside};
}

V8 PhotonAim::draw(const Cone8& cone, const EmissionPoint8& from, Pair8 u) {
  const V8 within = Frame8(cone.axis).to_world(square_to_cone(u, cone.one_minus_cos));
  if (cone.all.none()) {
    return within;
  }
  const V8 around = select(from.surface, around_surface(from, u), square_to_sphere(u));
  return select(cone.all, around, within);
}

/// `inside`: lanes whose direction was drawn in the cone.
F8 PhotonAim::density(const Cone8& cone, M8 inside, const EmissionPoint8& from, const V8& direction) {
  // 1 − cosθ of unit vectors, accurate for small angles.
  const F8 off_axis = length_squared(direction - cone.axis) * F8(0.5f);
  const F8 within = masked(inside | (off_axis <= cone.one_minus_cos), cone_pdf_solid_angle(cone.one_minus_cos));
  if (cone.all.none()) {
    return within;
  }
  const F8 around = select(from.surface, around_surface_pdf_solid_angle(from, direction), F8(0.25f * kInvPi));
  return select(cone.all, around, within);
}

/// The normals at those points of an emitting sphere of radius R that have some of the target above their horizon. For
/// a target of radius r at distance d, these are the normals at angles θ to its direction with d cosθ > R − r.
PhotonAim::Cap8 PhotonAim::cap(const Target& target, const LightSpheres8& spheres) {
  const V8 to_target = broadcast(target.center) - spheres.center;
  const F8 distance2 = length_squared(to_target);
  const F8 inverse = F8(1.0f) / sqrt(distance2);
  const F8 least_cos = (spheres.radius - F8(target.radius)) * inverse;
  // From inside a target, and if its direction is undefined: the whole sphere.
  const M8 cut = (least_cos > F8(-1.0f)) & M8(!target.all);
  const V8 axis = select(distance2 > F8(0.0f), to_target * inverse, broadcast(Vec3(0, 0, 1)));
  return {axis, F8(1.0f) - select(cut, min(least_cos, F8(kMaxCapCosine)), F8(-1.0f))};
}

V8 PhotonAim::facing(const LightSpheres8& spheres, Choice8& choice, Pair8 u) const {
  std::array<Cap8, kMaxPhotonTargets> caps;
  Cap8 chosen{};
  for (std::uint32_t t = 0; t < size(); ++t) {
    caps[t] = cap(targets_[t], spheres);
    const M8 this_one = choice.target == U8(t);
    chosen = {select(this_one, caps[t].axis, chosen.axis),
              select(this_one, caps[t].one_minus_cos, chosen.one_minus_cos)};
  }
  const V8 normal = Frame8(chosen.axis).to_world(square_to_cone(u, chosen.one_minus_cos));
  for (std::uint32_t t = 0; t < size(); ++t) {
    const F8 off_axis = length_squared(normal - caps[t].axis) * F8(0.5f);
    const M8 faces = (choice.target == U8(t)) | (off_axis <= caps[t].one_minus_cos);
    const F8 denser = masked(faces, F8(2.0f) / caps[t].one_minus_cos);
    choice.pmf[t] = select(spheres.lanes, choice.pmf[t] * denser, choice.pmf[t]);
  }
  return normal;
}

PhotonAim::Direction8 PhotonAim::direction(const EmissionPoint8& from, const Choice8& choice, Pair8 u) const {
  std::array<Cone8, kMaxPhotonTargets> cones;
  Cone8 chosen{};
  for (std::uint32_t t = 0; t < size(); ++t) {
    cones[t] = cone(targets_[t], from.point);
    const M8 this_one = choice.target == U8(t);
    chosen = {select(this_one, cones[t].axis, chosen.axis),
              select(this_one, cones[t].one_minus_cos, chosen.one_minus_cos),
              select(this_one, cones[t].all, chosen.all)};
  }
  const V8 drawn = draw(chosen, from, u);
  F8 pdf(0.0f);
  for (std::uint32_t t = 0; t < size(); ++t) {
    pdf += choice.pmf[t] * density(cones[t], choice.target == U8(t), from, drawn);
  }
  return {drawn, pdf};
}

F8 PhotonAim::pdf_solid_angle(const EmissionPoint8& from, const Choice8& choice, const V8& direction) const {
  F8 pdf(0.0f);
  for (std::uint32_t t = 0; t < size(); ++t) {
    pdf += choice.pmf[t] * density(cone(targets_[t], from.point), M8(), from, direction);
  }
  return pdf;
}

F8 PhotonAim::pdf_area(const V8& point, const V8& direction, const Choice8& choice) const {
  F8 pdf(0.0f);
  for (std::uint32_t t = 0; t < size(); ++t) {
    const F8 r(targets_[t].radius);
    const F8 aside2 = length_squared(cross(point - broadcast(targets_[t].center), direction));
    pdf += choice.pmf[t] * masked(aside2 <= r * r, F8(kInvPi) / (r * r));
  }
  return pdf;
}

PhotonAim::Direction8 PhotonAim::direction_to(std::size_t target, const EmissionPoint8& from, Pair8 u) const {
  const Cone8 only = cone(targets_[target], from.point);
  const V8 drawn = draw(only, from, u);
  return {drawn, density(only, M8(true), from, drawn)};
}

PhotonAim::Place8 PhotonAim::place(const V8& direction, const Choice8& choice, Pair8 u) const {
  V8 center = broadcast(Vec3(0));
  F8 radius(0.0f);
  for (std::uint32_t t = 0; t < size(); ++t) {
    const M8 this_one = choice.target == U8(t);
    center = select(this_one, broadcast(targets_[t].center), center);
    radius = select(this_one, F8(targets_[t].radius), radius);
  }
  const Pair8 on_disk = square_to_disk(u);
  const Frame8 frame(direction);
  const V8 point = center + (frame.s * on_disk.u + frame.t * on_disk.v) * radius;
  F8 pdf(0.0f);
  for (std::uint32_t t = 0; t < size(); ++t) {
    const F8 r(targets_[t].radius);
    const F8 aside2 = length_squared(cross(point - broadcast(targets_[t].center), direction));
    const M8 inside = (choice.target == U8(t)) | (aside2 <= r * r);
    pdf += choice.pmf[t] * masked(inside, F8(kInvPi) / (r * r));
  }
  return {point, pdf};
}

double PhotonAim::projected_area(std::size_t target) const {
  const double r = targets_[target].radius;
  return kPiDouble * r * r;
}

}  // namespace lightmill
