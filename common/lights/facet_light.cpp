#include "common/lights/facet_light.h"

#include <algorithm>
#include <cmath>

#include "common/lights/photometry.h"
#include "common/sampling/spherical_triangle.h"

namespace lightmill {
namespace {

/// Triangles nearer than this multiple of their radius are sampled by solid angle. For others, the density per solid
/// angle of a point uniform by area varies too little.
constexpr float kNearRadii = 3;
/// Range in which single precision resolves the solid angle and its samples.
constexpr float kSmallestSolidAngle = 3e-3f, kLargestSolidAngle = 6.2f;

}  // namespace

void FacetLights::add(const EmissiveFacet& facet) {
  corner_.add(facet.corner);
  edge1_.add(facet.edge1);
  edge2_.add(facet.edge2);
  const Vec3 area_vector = glm::cross(facet.edge1, facet.edge2);  // its length is the parallelogram's area
  const float whole_area = std::sqrt(glm::dot(area_vector, area_vector));
  normal_.add(area_vector * (1.0f / whole_area));
  density_.push_back((facet.parallelogram ? 1.0f : 2.0f) / whole_area);
  emission_.add(facet.radiance, facet.exponent, facet.two_sided);
  parallelogram_.push_back(facet.parallelogram ? 1 : 0);
  part_.push_back(facet.part);
  flipped_.push_back(facet.flipped ? 1 : 0);
  has_triangles_ |= !facet.parallelogram;
  if (has_textures_ || facet.texture.number != TextureSet::kNone) {
    has_textures_ = true;
    texture_.resize(size() - 1, TextureSet::kNone);  // for facets before the first one with a texture
    coordinates_.resize(6 * (size() - 1));
    texture_.push_back(facet.texture.number);
    for (const auto& pair : {facet.texture.corner, facet.texture.edge1, facet.texture.edge2}) {
      coordinates_.insert(coordinates_.end(), pair.begin(), pair.end());
    }
    if (facet.texture.number != TextureSet::kNone && !means_.contains(facet.texture.number)) {
      means_.emplace(facet.texture.number, textures_.mean(facet.texture.number));
    }
  }
}

Vec3d FacetLights::mean_radiance(std::size_t i) const {
  Vec3d radiance(emission_.radiance(i));
  if (has_textures_ && texture_[i] != TextureSet::kNone) {
    constexpr double kLimit = 1e36;  // as LightBuilder's limit of radiance
    const Vec3d& mean = means_.at(texture_[i]);
    for (int color = 0; color < 3; ++color) {
      radiance[color] = std::min(kLimit, std::max(0.0, radiance[color] * mean[color]));
    }
  }
  return radiance;
}

/// `place`: coordinates along the edges, from the corner.
V8 FacetLights::texture_at(U8 index, M8 lanes, Pair8 place) const {
  const U8 row = index * U8(6u);
  const auto coordinate = [&](std::uint32_t axis) {
    const auto part = [&](std::uint32_t which) {
      return gather(coordinates_.data(), row + U8(2 * which + axis), lanes);
    };
    return part(0) + place.u * part(1) + place.v * part(2);
  };
  const V8 rgb = textures_.lookup(gather(texture_.data(), index, lanes), coordinate(0), coordinate(1), lanes).rgb;
  return {max(rgb.x, F8(0.0f)), max(rgb.y, F8(0.0f)), max(rgb.z, F8(0.0f))};
}

LightBounds FacetLights::bounds(std::size_t i) const {
  const Vec3d corner(corner_[i]), edge1(edge1_[i]), edge2(edge2_[i]);
  const bool whole = parallelogram_[i] == 1;
  const Vec3d last = corner + edge1 + (whole ? edge2 : Vec3d(0));
  LightBounds b;
  b.low = glm::min(glm::min(corner, corner + edge1), glm::min(corner + edge2, last));
  b.high = glm::max(glm::max(corner, corner + edge1), glm::max(corner + edge2, last));
  const Vec3d area_vector = glm::cross(edge1, edge2);
  const double length = glm::length(area_vector), area = length * (whole ? 1 : 0.5);
  b.axis = area_vector / length;
  b.cos_normals = 1;
  b.cos_emission = 0;
  b.two_sided = emission_.two_sided(i);
  b.power = emission_.exitance(i, mean_radiance(i)) * area;
  b.intensity = luminance(mean_radiance(i)) * area;
  return b;
}

LightSample8 FacetLights::sample(const V8& p, U8 index, M8 lanes, Pair8 u) const {
  const V8 corner = corner_.at(index, lanes);
  const V8 edge1 = edge1_.at(index, lanes);
  const V8 edge2 = edge2_.at(index, lanes);
  const M8 two_sided = emission_.two_sided(index, lanes);
  const V8 normal = normal_.at(index, lanes);

  Pair8 b = u;
  Spherical near{};
  M8 whole = lanes;
  if (has_triangles_) {
    whole = is_whole(index, lanes);
    const Pair8 folded = square_to_triangle(u);
    b = {select(whole, u.u, folded.u), select(whole, u.v, folded.v)};
  }
  V8 y = corner + edge1 * b.u + edge2 * b.v;
  if (has_triangles_) {
    near = spherical(p, corner, edge1, edge2, and_not(lanes, whole));
    if (near.lanes.any()) {
      // Where the direction meets the plane.
      const V8 direction = sample_spherical_triangle(near.a, near.b, near.c, near.solid_angle, u);
      const F8 t = dot(corner - p, normal) / dot(direction, normal);
      y = select(near.lanes, p + direction * t, y);
      if (has_textures_) {
        const V8 from_corner = y - corner;
        const V8 area_vector = cross(edge1, edge2);
        const F8 whole_area = sqrt(length_squared(area_vector));
        const F8 area2 = whole_area * whole_area;
        b.u = select(near.lanes, dot(cross(from_corner, edge2), area_vector) / area2, b.u);
        b.v = select(near.lanes, dot(cross(edge1, from_corner), area_vector) / area2, b.v);
      }
    }
  }

  const V8 to_light = y - p;
  const F8 distance2 = length_squared(to_light);
  const F8 distance = sqrt(distance2);
  const V8 wi = to_light * (F8(1.0f) / distance);
  const F8 cos_signed = -dot(wi, normal);
  const F8 cos_light = select(two_sided, abs(cos_signed), cos_signed);
  M8 valid = lanes & (cos_light > F8(0.0f)) & (distance2 > F8(0.0f));

  const F8 pdf_by_area = gather_row(density_, index, lanes) * distance2 / cos_light;
  const F8 pdf = has_triangles_ ? select(near.lanes, F8(1.0f) / near.solid_angle, pdf_by_area) : pdf_by_area;
  V8 radiance = emission_.radiance(index, cos_light, lanes);
  if (has_textures_) {
    radiance = radiance * texture_at(index, lanes, b);
    valid = valid & (max_component(radiance) > F8(0.0f));
  }
  const V8 magnitude = abs(y) + abs(to_light) + abs(edge1) + abs(edge2);
  const V8 off = normal * copysign(surface_offset(normal, magnitude), cos_signed);
  return {y + off, wi, radiance * (F8(1.0f) / pdf), pdf, valid};
}

EmissionPoint8 FacetLights::emission_point(U8 index, M8 lanes, Pair8 u) const {
  const V8 edge1 = edge1_.at(index, lanes);
  const V8 edge2 = edge2_.at(index, lanes);
  const M8 whole = is_whole(index, lanes);
  const V8 area_vector = cross(edge1, edge2);
  const F8 whole_area = sqrt(length_squared(area_vector));
  const Pair8 folded = square_to_triangle(u);
  const Pair8 b{select(whole, u.u, folded.u), select(whole, u.v, folded.v)};
  EmissionPoint8 out;
  out.point = corner_.at(index, lanes) + edge1 * b.u + edge2 * b.v;
  out.normal = area_vector * (F8(1.0f) / whole_area);
  out.offset = surface_offset(out.normal, abs(out.point) + abs(edge1) + abs(edge2));
  out.area = select(whole, F8(1.0f), F8(0.5f)) * whole_area;
  out.texture = has_textures_ ? texture_at(index, lanes, b) : broadcast(Vec3(1));
  out.surface = lanes;
  out.two_sided = emission_.two_sided(index, lanes);
  return out;
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
  const F8 pdf_by_area = gather_row(density_, index, lanes) * (distance * distance) / cos_light;
  if (!has_triangles_) {
    return pdf_by_area;
  }
  const Spherical near = spherical(from, corner_.at(index, lanes), edge1_.at(index, lanes), edge2_.at(index, lanes),
                                   and_not(lanes, is_whole(index, lanes)));
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
