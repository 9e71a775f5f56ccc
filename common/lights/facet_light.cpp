#include "common/lights/facet_light.h"

#include <cmath>

#include "common/sampling/spherical_triangle.h"

namespace lightmill {
namespace {

/// Triangles nearer than so many of their radii are sampled by solid angle: beyond, the density per solid angle of a
/// point uniform by area varies less than that is worth.
constexpr float kNearRadii = 3;
/// Where single precision resolves the solid angle and what is drawn from it.
constexpr float kSmallestSolidAngle = 3e-3f, kLargestSolidAngle = 6.2f;

}  // namespace

void FacetLights::add(const EmissiveFacet& facet) {
  corner_.add(facet.corner);
  edge1_.add(facet.edge1);
  edge2_.add(facet.edge2);
  emission_.add(facet.radiance, facet.exponent, facet.two_sided);
  parallelogram_.push_back(facet.parallelogram ? 1 : 0);
  part_.push_back(facet.part);
  flipped_.push_back(facet.flipped ? 1 : 0);
  has_triangles_ |= !facet.parallelogram;
}

LightBounds FacetLights::bounds(std::size_t i) const {
  const Vec3d corner(corner_[i]), edge1(edge1_[i]), edge2(edge2_[i]);
  const bool whole = parallelogram_[i] == 1;
  const Vec3d last = corner + edge1 + (whole ? edge2 : Vec3d(0));
  LightBounds b;
  b.low = glm::min(glm::min(corner, corner + edge1), glm::min(corner + edge2, last));
  b.high = glm::max(glm::max(corner, corner + edge1), glm::max(corner + edge2, last));
  const Vec3d area_vector = glm::cross(edge1, edge2);
  const double area = glm::length(area_vector);
  b.axis = area_vector / area;
  b.cos_normals = 1;
  b.cos_emission = 0;
  b.two_sided = emission_.two_sided(i);
  b.power = emission_.exitance(i) * area * (whole ? 1 : 0.5);
  return b;
}

LightSample8 FacetLights::sample(const V8& p, U8 index, M8 lanes, Pair8 u) const {
  const V8 corner = corner_.at(index, lanes);
  const V8 edge1 = edge1_.at(index, lanes);
  const V8 edge2 = edge2_.at(index, lanes);
  const M8 two_sided = emission_.two_sided(index, lanes);
  const M8 whole = gather(parallelogram_.data(), index, lanes) == U8(1u);
  const V8 area_vector = cross(edge1, edge2);  // as long as the parallelogram's area
  const F8 whole_area = sqrt(length_squared(area_vector));
  const V8 normal = area_vector * (F8(1.0f) / whole_area);

  const Pair8 folded = square_to_triangle(u);
  const Pair8 b{select(whole, u.u, folded.u), select(whole, u.v, folded.v)};
  V8 y = corner + edge1 * b.u + edge2 * b.v;
  Spherical near{};
  if (has_triangles_) {
    near = spherical(p, corner, edge1, edge2, and_not(lanes, whole));
    if (near.lanes.any()) {
      // Where the direction meets the plane.
      const V8 direction = sample_spherical_triangle(near.a, near.b, near.c, near.solid_angle, u);
      const F8 t = dot(corner - p, normal) / dot(direction, normal);
      y = select(near.lanes, p + direction * t, y);
    }
  }

  const V8 to_light = y - p;
  const F8 distance2 = length_squared(to_light);
  const F8 distance = sqrt(distance2);
  const V8 wi = to_light * (F8(1.0f) / distance);
  const F8 cos_signed = -dot(wi, normal);
  const F8 cos_light = select(two_sided, abs(cos_signed), cos_signed);
  const M8 valid = lanes & (cos_light > F8(0.0f)) & (distance2 > F8(0.0f));

  const F8 pdf_by_area = select(whole, F8(1.0f), F8(2.0f)) / whole_area * distance2 / cos_light;
  const F8 pdf = has_triangles_ ? select(near.lanes, F8(1.0f) / near.solid_angle, pdf_by_area) : pdf_by_area;
  const V8 radiance = emission_.radiance(index, cos_light, lanes);
  const V8 magnitude = abs(y) + abs(to_light) + abs(edge1) + abs(edge2);
  const V8 off = normal * copysign(surface_offset(normal, magnitude), cos_signed);
  return {y + off, wi, radiance * (F8(1.0f) / pdf), pdf, valid};
}

EmissiveFacet FacetLights::facet(std::size_t i) const {
  return {corner_[i],
          edge1_[i],
          edge2_[i],
          emission_.radiance(i),
          emission_.two_sided(i),
          parallelogram_[i] == 1,
          emission_.exponent(i),
          part_[i],
          flipped_[i] == 1};
}

F8 FacetLights::pdf_solid_angle(const V8& from, U8 index, F8 distance, F8 cos_light, M8 lanes) const {
  const V8 edge1 = edge1_.at(index, lanes);
  const V8 edge2 = edge2_.at(index, lanes);
  const M8 whole = gather(parallelogram_.data(), index, lanes) == U8(1u);
  const F8 whole_area = sqrt(length_squared(cross(edge1, edge2)));
  const F8 pdf_by_area = select(whole, F8(1.0f), F8(2.0f)) / whole_area * (distance * distance) / cos_light;
  if (!has_triangles_) {
    return pdf_by_area;
  }
  const Spherical near = spherical(from, corner_.at(index, lanes), edge1, edge2, and_not(lanes, whole));
  return select(near.lanes, F8(1.0f) / near.solid_angle, pdf_by_area);
}

FacetLights::Spherical FacetLights::spherical(const V8& p, const V8& corner, const V8& edge1, const V8& edge2,
                                              M8 triangles) const {
  const V8 to_corner = corner - p;
  const V8 to_middle = (edge1 + edge2) * F8(1.0f / 3);  // from the corner to the centroid
  const F8 radius2 =
      max(length_squared(to_middle), max(length_squared(edge1 - to_middle), length_squared(edge2 - to_middle)));
  Spherical out{};
  out.lanes = triangles & (length_squared(to_corner + to_middle) < F8(kNearRadii * kNearRadii) * radius2);
  if (out.lanes.any()) {
    out.a = normalize(to_corner);
    out.b = normalize(to_corner + edge1);
    out.c = normalize(to_corner + edge2);
    out.solid_angle = triangle_solid_angle(out.a, out.b, out.c);
    out.lanes = out.lanes & (out.solid_angle > F8(kSmallestSolidAngle)) & (out.solid_angle < F8(kLargestSolidAngle));
  }
  return out;
}

}  // namespace lightmill
