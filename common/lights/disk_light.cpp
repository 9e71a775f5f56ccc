#include "common/lights/disk_light.h"

#include <array>
#include <cmath>

#include "common/lights/closed_form_irradiance.h"
#include "common/lights/photometry.h"

namespace lightmill {

void DiskLights::add(const DiskEmitter& disk) {
  center_.add(disk.center);
  half_axis1_.add(disk.half_axis1);
  half_axis2_.add(disk.half_axis2);
  const Vec3d across = glm::cross(Vec3d(disk.half_axis1), Vec3d(disk.half_axis2));
  normal_.add(Vec3(glm::normalize(across)));
  density_.push_back(static_cast<float>(1 / ((disk.rectangular ? 4 : kPiDouble) * glm::length(across))));
  radiance_.add(disk.radiance);
  const bool narrow = disk.spread < kPiDouble;
  spread_.push_back(disk.spread);
  cot_.push_back(narrow ? static_cast<float>(cos_fixed(disk.spread / 2) / sin_fixed(disk.spread / 2)) : 0.0f);
  has_spread_ |= narrow;
  rectangular_.push_back(disk.rectangular ? 1 : 0);
  has_rectangles_ |= disk.rectangular;
}

LightBounds DiskLights::bounds(std::size_t i) const {
  const Vec3d center(center_[i]), a(half_axis1_[i]), b(half_axis2_[i]);
  const Vec3d half = rectangular_[i] == 1 ? glm::abs(a) + glm::abs(b) : glm::sqrt(a * a + b * b);
  LightBounds out;
  out.low = center - half;
  out.high = center + half;
  out.axis = Vec3d(normal_[i]);
  out.cos_normals = 1;
  out.cos_emission = cos_fixed(spread_[i] / 2);
  out.intensity = luminance(Vec3d(radiance_[i])) * area(i);
  out.power = out.intensity * spread_exitance_per_radiance(spread_[i]);
  return out;
}

V8 DiskLights::radiance(U8 index, F8 cos_light, M8 lanes) const {
  const V8 along_normal = radiance_.at(index, lanes);
  if (!has_spread_) {
    return along_normal;
  }
  const F8 tangent = sqrt(max(F8(1.0f) - cos_light * cos_light, F8(0.0f))) / cos_light;
  return along_normal * max(F8(1.0f) - tangent * gather(cot_.data(), index, lanes), F8(0.0f));
}

/// Uniform by area.
V8 DiskLights::point(U8 index, M8 lanes, Pair8 u) const {
  const M8 square = rectangular(index, lanes);
  const Pair8 d = square_to_disk(u);
  const F8 x = select(square, F8(2.0f) * u.u - F8(1.0f), d.u), y = select(square, F8(2.0f) * u.v - F8(1.0f), d.v);
  return center_.at(index, lanes) + half_axis1_.at(index, lanes) * x + half_axis2_.at(index, lanes) * y;
}

LightSample8 DiskLights::sample(const V8& p, U8 index, M8 lanes, Pair8 u) const {
  const V8 y = point(index, lanes, u);
  const V8 to_light = y - p;
  const F8 distance2 = length_squared(to_light), distance = sqrt(distance2);
  const V8 wi = to_light * (F8(1.0f) / distance);
  const F8 cos_light = -dot(wi, normal_.at(index, lanes));
  const V8 from_there = radiance(index, cos_light, lanes);
  const M8 lit = (cos_light > F8(0.0f)) & (max_component(from_there) > F8(0.0f));
  const F8 pdf = pdf_solid_angle(index, distance, cos_light, lanes);
  return {y, wi, from_there * (F8(1.0f) / pdf), pdf, lanes & lit & (distance2 > F8(0.0f))};
}

LightSample8 DiskLights::sample(const V8& p, U8 index, M8 lanes) const {
  const V8 center = center_.at(index, lanes), to_light = center - p;
  const F8 distance2 = length_squared(to_light);
  const V8 wi = to_light * (F8(1.0f) / sqrt(distance2));
  const F8 cos_light = -dot(wi, normal_.at(index, lanes));
  const F8 per_radiance = cos_light / (gather_row(density_, index, lanes) * distance2);
  return {center, wi, radiance(index, cos_light, lanes) * per_radiance, F8(0.0f), lanes & (cos_light > F8(0.0f))};
}

EmissionPoint8 DiskLights::emission_point(U8 index, M8 lanes, Pair8 u) const {
  EmissionPoint8 out{};
  out.point = point(index, lanes, u);
  out.normal = normal_.at(index, lanes);
  out.area = F8(1.0f) / gather_row(density_, index, lanes);
  out.texture = broadcast(Vec3(1));
  out.surface = lanes;
  return out;
}

DiskLights::Entry8 DiskLights::meet(const V8& origin, const V8& direction, U8 index, M8 lanes) const {
  const V8 normal = normal_.at(index, lanes), a = half_axis1_.at(index, lanes), b = half_axis2_.at(index, lanes);
  const V8 to_center = center_.at(index, lanes) - origin;
  const F8 cosine = -dot(direction, normal);
  const F8 distance = -dot(to_center, normal) / cosine;
  const V8 q = direction * distance - to_center;
  const F8 x = dot(q, a) / length_squared(a), y = dot(q, b) / length_squared(b);
  const F8 x2 = x * x, y2 = y * y;
  const M8 within = select(rectangular(index, lanes), max(x2, y2), x2 + y2) < F8(1.0f);
  return {lanes & within & (cosine > F8(0.0f)) & (distance > F8(0.0f)), distance, cosine};
}

F8 DiskLights::pdf_solid_angle(U8 index, F8 distance, F8 cos_light, M8 lanes) const {
  return gather_row(density_, index, lanes) * (distance * distance) / cos_light;
}

Vec3d DiskLights::irradiance(std::size_t i, const Vec3d& p, const Vec3d& n) const {
  const Vec3d to_center = Vec3d(center_[i]) - p, a(half_axis1_[i]), b(half_axis2_[i]);
  if (glm::dot(to_center, Vec3d(normal_[i])) >= 0) {
    return Vec3d(0);
  }
  if (rectangular_[i] == 1) {
    const std::array<Vec3d, 4> corners{to_center + a + b, to_center - a + b, to_center - a - b, to_center + a - b};
    return Vec3d(radiance_[i]) * polygon_irradiance(corners, n);
  }
  const double step = 2 * kPiDouble / kMaxPolygonCorners, equal_area = std::sqrt(step / sin_fixed(step));
  std::array<Vec3d, kMaxPolygonCorners> corners;
  for (std::size_t k = 0; k < corners.size(); ++k) {
    const double turn = step * static_cast<double>(k);
    corners[k] = to_center + (a * cos_fixed(turn) + b * sin_fixed(turn)) * equal_area;
  }
  return Vec3d(radiance_[i]) * polygon_irradiance(corners, n);
}

}  // namespace lightmill
