#include "common/lights/light_table.h"

#include "common/base/check.h"

namespace lightmill {
namespace {

/// Relative luminance (Rec. 709) as the measure of power: only how lights are chosen depends on it.
double luminance(const Vec3& c) {
  return 0.2126 * c.x + 0.7152 * c.y + 0.0722 * c.z;
}

double area_of(const EmissiveFacet& f) {
  return (f.parallelogram ? 1.0 : 0.5) * glm::length(glm::cross(Vec3d(f.edge1), Vec3d(f.edge2)));
}

double area_of(const EmissiveSphere& s) {
  return 4 * kPiDouble * s.radius * s.radius;
}

/// Emitted by a surface per unit of area, in luminance.
double exitance(const Vec3& radiance, bool two_sided) {
  return luminance(radiance) * kPiDouble * (two_sided ? 2 : 1);
}

LightSample8 merge(M8 lanes, const LightSample8& a, const LightSample8& b) {
  return {select(lanes, a.point, b.point), select(lanes, a.wi, b.wi), select(lanes, a.weight, b.weight),
          select(lanes, a.pdf_solid_angle, b.pdf_solid_angle), (a.valid & lanes) | and_not(b.valid, lanes)};
}

}  // namespace

void LightTable::push(Kind kind, const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& radiance, bool flip,
                      bool two_sided, bool parallelogram) {
  kind_.push_back(kind);
  flip_.push_back(flip ? 1 : 0);
  two_sided_.push_back(two_sided ? 1 : 0);
  parallelogram_.push_back(parallelogram ? 1 : 0);
  const auto put = [](std::vector<float>& array, const Vec3& v) { array.insert(array.end(), {v.x, v.y, v.z}); };
  put(a_, a);
  put(b_, b);
  put(c_, c);
  put(radiance_, radiance);
}

void LightTable::build() {
  std::vector<double> power;
  for (const EmissiveFacet& f : facets_) {
    push(kFacet, f.corner, f.edge1, f.edge2, f.radiance, false, f.two_sided, f.parallelogram);
    power.push_back(exitance(f.radiance, f.two_sided) * area_of(f));
  }
  for (const EmissiveSphere& s : spheres_) {
    push(kSphere, s.center, Vec3(s.radius, 0, 0), Vec3(0), s.radiance, s.inward, s.two_sided, false);
    power.push_back(exitance(s.radiance, s.two_sided) * area_of(s));
  }
  for (const PointEmitter& p : points_) {
    push(kPoint, p.position, Vec3(0), Vec3(0), p.intensity, false, false, false);
    power.push_back(4 * kPiDouble * luminance(p.intensity));
  }
  total_power_ = 0;
  for (const double p : power) {
    total_power_ += p;
  }
  if (total_power_ > 0) {
    choice_.emplace(power);
  }
}

float LightTable::facet_pdf_area(const Vec3& radiance, bool two_sided) const {
  return total_power_ > 0 ? static_cast<float>(exitance(radiance, two_sided) / total_power_) : 0.0f;
}

float LightTable::sphere_choice_probability(const EmissiveSphere& s) const {
  return total_power_ > 0 ? static_cast<float>(exitance(s.radiance, s.two_sided) * area_of(s) / total_power_) : 0.0f;
}

LightSample8 LightTable::sample(const V8& p, F8 choice, Pair8 u) const {
  // With one light there is nothing to choose, and no probability but 1.
  const bool single = size() == 1;
  const DiscreteDistribution::Choice8 chosen =
      single ? DiscreteDistribution::Choice8{U8(0u), F8(1.0f)} : choice_->sample(choice);
  const M8 all(true);
  const U8 kind = gather(kind_.data(), chosen.index, all);
  const M8 facet = kind == U8(kFacet);
  const M8 sphere = kind == U8(kSphere);
  const M8 point = kind == U8(kPoint);

  LightSample8 result;
  if (facet.any()) {
    result = sample_facets(p, chosen.index, facet, chosen.pmf, u);
  }
  if (sphere.any()) {
    result = merge(sphere, sample_spheres(p, chosen.index, sphere, chosen.pmf, u), result);
  }
  if (point.any()) {
    result = merge(point, sample_points(p, chosen.index, point, chosen.pmf), result);
  }
  return result;
}

LightSample8 LightTable::sample_facets(const V8& p, U8 index, M8 lanes, F8 pmf, Pair8 u) const {
  const V8 corner = gather3(a_.data(), index, lanes);
  const V8 edge1 = gather3(b_.data(), index, lanes);
  const V8 edge2 = gather3(c_.data(), index, lanes);
  const V8 radiance = gather3(radiance_.data(), index, lanes);
  const M8 two_sided = gather(two_sided_.data(), index, lanes) == U8(1u);

  const M8 whole = gather(parallelogram_.data(), index, lanes) == U8(1u);
  const Pair8 folded = square_to_triangle(u);
  const Pair8 b{select(whole, u.u, folded.u), select(whole, u.v, folded.v)};
  const V8 y = corner + edge1 * b.u + edge2 * b.v;
  const V8 area_vector = cross(edge1, edge2);  // as long as the parallelogram's area
  const F8 whole_area = sqrt(length_squared(area_vector));
  const V8 normal = area_vector * (F8(1.0f) / whole_area);

  const V8 to_light = y - p;
  const F8 distance2 = length_squared(to_light);
  const F8 distance = sqrt(distance2);
  const V8 wi = to_light * (F8(1.0f) / distance);
  const F8 cos_signed = -dot(wi, normal);
  const F8 cos_light = select(two_sided, abs(cos_signed), cos_signed);
  const M8 valid = lanes & (cos_light > F8(0.0f)) & (distance2 > F8(0.0f));

  const F8 pdf_area = pmf * select(whole, F8(1.0f), F8(2.0f)) / whole_area;
  const F8 pdf = pdf_area * distance2 / cos_light;
  const V8 magnitude = abs(y) + abs(to_light) + abs(edge1) + abs(edge2);
  const V8 off = normal * copysign(surface_offset(normal, magnitude), cos_signed);
  return {y + off, wi, radiance * (F8(1.0f) / pdf), pdf, valid};
}

F8 sphere_pdf_solid_angle(const V8& from, const V8& center, F8 radius, F8 distance, F8 cos_light) {
  const F8 center2 = length_squared(center - from);
  const F8 sin2_max = radius * radius / center2;
  const M8 outside = sin2_max < F8(1.0f);
  const F8 cos_max = sqrt(max(F8(1.0f) - sin2_max, F8(0.0f)));
  const F8 cone = cone_pdf_solid_angle(sin2_max / (F8(1.0f) + cos_max));
  const F8 area = distance * distance / (cos_light * F8(4 * kPi) * radius * radius);
  return select(outside, cone, area);
}

LightSample8 LightTable::sample_spheres(const V8& p, U8 index, M8 lanes, F8 pmf, Pair8 u) const {
  const V8 center = gather3(a_.data(), index, lanes);
  const F8 radius = gather(b_.data(), index + index + index, lanes);
  const V8 radiance = gather3(radiance_.data(), index, lanes);
  const M8 inward = gather(flip_.data(), index, lanes) == U8(1u);
  const M8 two_sided = gather(two_sided_.data(), index, lanes) == U8(1u);

  // From outside: a direction in the cone that the sphere fills, and where it enters.
  const V8 to_center = center - p;
  const F8 center2 = length_squared(to_center);
  const F8 sin2_max = radius * radius / center2;
  const M8 outside = sin2_max < F8(1.0f);
  const F8 cos_max = sqrt(max(F8(1.0f) - sin2_max, F8(0.0f)));
  const V8 local = square_to_cone(u, sin2_max / (F8(1.0f) + cos_max));
  const F8 center_distance = sqrt(center2);
  const V8 cone_wi = Frame8(to_center * (F8(1.0f) / center_distance)).to_world(local);
  const F8 sin2 = F8(1.0f) - local.z * local.z;
  const F8 entry = center_distance * local.z - sqrt(max(radius * radius - center2 * sin2, F8(0.0f)));
  const V8 cone_normal = normalize(p + cone_wi * entry - center);

  // From inside: a point uniform by area.
  const V8 normal = select(outside, cone_normal, square_to_sphere(u));
  const V8 y = center + normal * radius;
  const V8 to_light = y - p;
  const F8 distance2 = length_squared(to_light);
  const F8 distance = sqrt(distance2);
  const V8 wi = select(outside, cone_wi, to_light * (F8(1.0f) / distance));

  const F8 cos_outward = -dot(wi, normal);  // positive where the outer side is seen
  const F8 cos_emitting = select(inward, -cos_outward, cos_outward);
  const F8 cos_light = select(two_sided, abs(cos_outward), cos_emitting);
  const M8 valid = lanes & (cos_light > F8(0.0f)) & (distance2 > F8(0.0f));

  const F8 pdf = pmf * sphere_pdf_solid_angle(p, center, radius, distance, cos_light);
  // Embree finds a sphere from afar only to some 3e-6 of the distance: stay well in front of that.
  const F8 magnitude = F8(8.0f) * (max_component(abs(y)) + distance);
  const V8 off = normal * copysign(F8(0x1p-19f) * magnitude, cos_outward);
  return {y + off, wi, radiance * (F8(1.0f) / pdf), pdf, valid};
}

LightSample8 LightTable::sample_points(const V8& p, U8 index, M8 lanes, F8 pmf) const {
  const V8 position = gather3(a_.data(), index, lanes);
  const V8 intensity = gather3(radiance_.data(), index, lanes);
  const V8 to_light = position - p;
  const F8 distance2 = length_squared(to_light);
  const M8 valid = lanes & (distance2 > F8(0.0f));
  const V8 wi = to_light * (F8(1.0f) / sqrt(distance2));
  return {position, wi, intensity * (F8(1.0f) / (distance2 * pmf)), F8(0.0f), valid};
}

}  // namespace lightmill
