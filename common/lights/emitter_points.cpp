#include "common/lights/emitter_points.h"

#include "common/lights/photometry.h"

namespace lightmill {
namespace {

/// Normals cancel if their mean is shorter than this. In closed meshes the rest is rounding.
constexpr double kCancelled = 1e-3;

}  // namespace

void FacetSums::add(const EmissiveFacet& facet, bool closed) {
  const Vec3d corner(facet.corner), edge1(facet.edge1), edge2(facet.edge2);
  if (parts_.empty()) {
    low_ = high_ = corner;
    radiance_ = Vec3d(facet.radiance);
    exponent_ = facet.exponent;
    two_sided_ = facet.two_sided;
  }
  // The last point is the fourth corner of a parallelogram. For a triangle it repeats a corner.
  for (const Vec3d& p :
       {corner, corner + edge1, corner + edge2, facet.parallelogram ? corner + edge1 + edge2 : corner}) {
    low_ = glm::min(low_, p);
    high_ = glm::max(high_, p);
  }
  const Vec3d area_normal = glm::cross(edge1, edge2) * (facet.parallelogram ? 1.0 : 0.5);
  Part& part = parts_[facet.part];
  part.area_normal += facet.flipped ? -area_normal : area_normal;
  part.area += glm::length(area_normal);
  part.closed = closed;
}

FacetSums::Total FacetSums::total() const {
  Total sum;
  for (const auto& [number, part] : parts_) {
    const bool against = two_sided_ && glm::dot(sum.area_normal, part.area_normal) < 0;
    sum.area_normal += against ? -part.area_normal : part.area_normal;
    sum.area += part.area;
    sum.shining_area += part.area * (two_sided_ && !part.closed ? 2 : 1);
  }
  return sum;
}

void EmitterPoints::add(std::uint32_t geometry, const FacetSums& facets) {
  const FacetSums::Total total = facets.total();
  const Vec3d flux_per_solid_angle = facets.radiance_ * total.shining_area;
  if (flux_per_solid_angle == Vec3d(0)) {
    return;
  }
  const Vec3d center = (facets.low_ + facets.high_) * 0.5;
  const double length = glm::length(total.area_normal);
  if (length <= kCancelled * total.area) {
    add_point(geometry,
              {Vec3(center), Vec3(flux_per_solid_angle * exitance_per_radiance(facets.exponent_) / kPointSolidAngle)});
    return;
  }
  const Vec3d normal = total.area_normal / length;
  // Slightly off the surface, so that objects that touch its back do not block the light.
  const Vec3d magnitude = glm::max(glm::abs(facets.low_), glm::abs(facets.high_)) + (facets.high_ - facets.low_);
  const Vec3d off = normal * (0x1p-19 * glm::dot(glm::abs(normal), magnitude));
  const int sides = facets.two_sided_ ? 2 : 1;
  for (int i = 0; i < sides; ++i) {
    const double side = i == 0 ? 1 : -1;
    add_cosine_power(geometry, {Vec3(center + off * side), Vec3(normal * side),
                                Vec3(flux_per_solid_angle * (1.0 / sides)), static_cast<float>(facets.exponent_ + 1)});
  }
}

void EmitterPoints::add(std::uint32_t geometry, const EmissiveSphere& sphere) {
  const double intensity_per_radiance =
      sphere.radius * static_cast<double>(sphere.radius) * exitance_per_radiance(sphere.exponent);
  if (sphere.radiance != Vec3(0)) {
    add_point(geometry, {sphere.center, Vec3(Vec3d(sphere.radiance) * intensity_per_radiance)});
  }
}

void EmitterPoints::add_point(std::uint32_t geometry, const PointEmitter& point) {
  geometry_.push_back(geometry);
  row_.push_back(kPoint + static_cast<std::uint32_t>(points_.size()));
  points_.add(point);
}

void EmitterPoints::add_cosine_power(std::uint32_t geometry, const CosinePowerEmitter& emitter) {
  geometry_.push_back(geometry);
  row_.push_back(static_cast<std::uint32_t>(cosine_powers_.size()));
  cosine_powers_.add(emitter);
}

LightSample8 EmitterPoints::sample(std::size_t i, const V8& p, M8 lanes) const {
  return row_[i] >= kPoint ? points_.sample(p, U8(row_[i] - kPoint), lanes)
                           : cosine_powers_.sample(p, U8(row_[i]), lanes);
}

}  // namespace lightmill
