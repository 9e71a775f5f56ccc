#include "common/lights/hard_lights.h"

#include "common/lights/photometry.h"

namespace lightmill {
namespace {

/// Normals whose mean is shorter than this cancel: what is left of those of closed meshes is rounding.
constexpr double kCancelled = 1e-3;

}  // namespace

void FacetSums::add(const EmissiveFacet& facet) {
  const Vec3d corner(facet.corner), edge1(facet.edge1), edge2(facet.edge2);
  if (area_ == 0) {
    low_ = high_ = corner;
    radiance_ = Vec3d(facet.radiance);
    exponent_ = facet.exponent;
    two_sided_ = facet.two_sided;
  }
  // The fourth corner of a parallelogram, or one that is there already.
  for (const Vec3d& p :
       {corner, corner + edge1, corner + edge2, facet.parallelogram ? corner + edge1 + edge2 : corner}) {
    low_ = glm::min(low_, p);
    high_ = glm::max(high_, p);
  }
  const Vec3d area_normal = glm::cross(edge1, edge2) * (facet.parallelogram ? 1.0 : 0.5);
  area_normal_ += area_normal;
  area_ += glm::length(area_normal);
}

bool FacetSums::closed() const {
  return glm::length(area_normal_) <= kCancelled * area_;
}

void HardLights::add(std::uint32_t geometry, const FacetSums& facets) {
  const Vec3d flux_per_solid_angle = facets.radiance_ * facets.area_;
  if (flux_per_solid_angle == Vec3d(0)) {
    return;
  }
  const Vec3d center = (facets.low_ + facets.high_) * 0.5;
  const double length = glm::length(facets.area_normal_);
  if (facets.closed()) {
    add_point(geometry,
              {Vec3(center), Vec3(flux_per_solid_angle * exitance_per_radiance(facets.exponent_) / kPointSolidAngle)});
    return;
  }
  const Vec3d normal = facets.area_normal_ / length;
  // A hair off the surface, so that what touches its back does not stop the light.
  const Vec3d magnitude = glm::max(glm::abs(facets.low_), glm::abs(facets.high_)) + (facets.high_ - facets.low_);
  const Vec3d off = normal * (0x1p-19 * glm::dot(glm::abs(normal), magnitude));
  for (const double side : {1.0, -1.0}) {
    add_cosine_power(geometry, {Vec3(center + off * side), Vec3(normal * side), Vec3(flux_per_solid_angle),
                                static_cast<float>(facets.exponent_ + 1)});
    if (!facets.two_sided_) {
      return;
    }
  }
}

void HardLights::add(std::uint32_t geometry, const EmissiveSphere& sphere) {
  const double intensity_per_radiance =
      sphere.radius * static_cast<double>(sphere.radius) * exitance_per_radiance(sphere.exponent);
  if (sphere.radiance != Vec3(0)) {
    add_point(geometry, {sphere.center, Vec3(Vec3d(sphere.radiance) * intensity_per_radiance)});
  }
}

void HardLights::add_point(std::uint32_t geometry, const PointEmitter& point) {
  geometry_.push_back(geometry);
  row_.push_back(kPoint + static_cast<std::uint32_t>(points_.size()));
  points_.add(point);
}

void HardLights::add_cosine_power(std::uint32_t geometry, const CosinePowerEmitter& emitter) {
  geometry_.push_back(geometry);
  row_.push_back(static_cast<std::uint32_t>(cosine_powers_.size()));
  cosine_powers_.add(emitter);
}

LightSample8 HardLights::sample(std::size_t i, const V8& p, M8 lanes) const {
  return row_[i] >= kPoint ? points_.sample(p, U8(row_[i] - kPoint), lanes)
                           : cosine_powers_.sample(p, U8(row_[i]), lanes);
}

}  // namespace lightmill
