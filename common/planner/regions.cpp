#include "common/planner/regions.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <variant>

#include "common/base/overloaded.h"
#include "common/math/transcendental.h"
#include "common/math/vec.h"
#include "common/planner/narrow_lobes.h"
#include "common/scene/mesh.h"

namespace lightmill {
namespace {

Vec3d placed(const Object& object, const Point3d& p) {
  const Transform& t = object.transform;
  const auto row = [&](std::size_t i) { return t[i][0] * p[0] + t[i][1] * p[1] + t[i][2] * p[2] + t[i][3]; };
  return {row(0), row(1), row(2)};
}

Extent extent_of(const std::vector<std::array<Vec3d, 3>>& triangles) {
  Vec3d low(std::numeric_limits<double>::infinity()), high = -low;
  Extent extent;
  for (const auto& t : triangles) {
    extent.area += glm::length(glm::cross(t[1] - t[0], t[2] - t[0])) / 2;
    for (const Vec3d& corner : t) {
      low = glm::min(low, corner);
      high = glm::max(high, corner);
    }
  }
  extent.center = (low + high) / 2.0;
  extent.radius = glm::length(high - low) / 2;
  return extent;
}

std::optional<Extent> extent_of(const Object& object, const MeshShape& shape, const MeshSource& meshes) {
  const std::optional<std::string> bytes = meshes.bytes ? meshes.bytes(shape.asset) : std::nullopt;
  if (!bytes || bytes->size() > MeshSource::kMostBytes) {
    return std::nullopt;
  }
  const Result<Mesh> mesh = decode_mesh(as_byte_view(*bytes));
  if (!mesh.ok()) {
    return std::nullopt;  // rendering reports the error
  }
  std::vector<std::array<Vec3d, 3>> triangles;
  for (const auto& corners : mesh->triangles) {
    std::array<Vec3d, 3>& triangle = triangles.emplace_back();
    for (std::size_t i = 0; i < 3; ++i) {
      triangle[i] = placed(object, mesh->positions[corners[i]]);
    }
  }
  return extent_of(triangles);
}

/// Positions of all objects whose material counts; empty if one is unknown.
template <class Counts>
std::optional<Regions> regions_of(const Scene& scene, const MeshSource& meshes, const Counts& counts) {
  Regions regions;
  for (const Object& object : scene.objects) {
    if (!counts(scene.materials[object.material])) {
      continue;
    }
    if (const auto* const plane = std::get_if<PlaneShape>(&object.shape)) {
      if (object.transform != kIdentityTransform) {
        return std::nullopt;
      }
      regions.push_back({*plane, false, &object});
    } else if (const std::optional<Extent> extent = extent_of(object, meshes)) {
      regions.push_back({*extent, std::holds_alternative<SphereShape>(object.shape), &object});
    } else {
      return std::nullopt;
    }
  }
  return regions;
}

/// Empty for radiance meters, which measure as a camera does.
std::optional<Extent> extent_of(const Meter& meter) {
  const auto vector = [](const Point3d& v) { return Vec3d(v[0], v[1], v[2]); };
  const auto across = [&](const Patch& patch) -> std::optional<Extent> {
    const Vec3d corner = vector(patch.corner), edge1 = vector(patch.edge1), edge2 = vector(patch.edge2);
    return extent_of(
        {{corner, corner + edge1, corner + edge2}, {corner + edge1, corner + edge2, corner + edge1 + edge2}});
  };
  return std::visit(Overloaded{[&](const IrradianceMeter& m) -> std::optional<Extent> {
                                 return Extent{vector(m.point), 0, 0};
                               },
                               [&](const PatchMeter& m) { return across(m.patch); },
                               [&](const FluxMeter& m) { return across(m.patch); },
                               [](const RadianceMeter&) { return std::optional<Extent>(); }},
                    meter.kind);
}

}  // namespace

std::optional<Extent> extent_of(const Object& object, const MeshSource& meshes) {
  return std::visit(Overloaded{[&](const SphereShape& s) -> std::optional<Extent> {
                                 const Vec3d center = placed(object, s.center);
                                 const double radius = glm::length(
                                     placed(object, {s.center[0] + s.radius, s.center[1], s.center[2]}) - center);
                                 return Extent{center, radius, kPiDouble * radius * radius};
                               },
                               [&](const TriangleShape& t) -> std::optional<Extent> {
                                 return extent_of({{placed(object, t.a), placed(object, t.b), placed(object, t.c)}});
                               },
                               [&](const MeshShape& m) { return extent_of(object, m, meshes); },
                               [](const auto&) { return std::optional<Extent>(); }},
                    object.shape);
}

double Region::distance(const Vec3d& p) const {
  if (const auto* const plane = std::get_if<PlaneShape>(&shape)) {
    const auto vector = [](const Point3d& v) { return Vec3d(v[0], v[1], v[2]); };
    return std::abs(glm::dot(p - vector(plane->point), glm::normalize(vector(plane->normal))));
  }
  const auto& extent = std::get<Extent>(shape);
  const double from_center = glm::length(p - extent.center);
  return hollow ? std::abs(from_center - extent.radius) : std::max(from_center - extent.radius, 0.0);
}

Regions narrow_regions(const Scene& scene, const MeshSource& meshes) {
  const auto counts = [](const Material& material) { return narrow_lobes(material) != NarrowLobes::none; };
  return regions_of(scene, meshes, counts).value_or(Regions{});
}

Regions receiver_regions(const Scene& scene, const MeshSource& meshes) {
  std::optional<Regions> regions = regions_of(scene, meshes, receives_light);
  if (!regions) {
    return {};
  }
  for (const Meter& meter : scene.meters) {
    if (const std::optional<Extent> extent = extent_of(meter)) {
      regions->push_back({*extent, false, nullptr});
    }
  }
  return *std::move(regions);
}

bool is_small_from(const Regions& regions, const Object* emitter, const Extent& extent) {
  double nearest = std::numeric_limits<double>::infinity();
  for (const Region& region : regions) {
    if (emitter == nullptr || region.object != emitter) {
      nearest = std::min(nearest, region.distance(extent.center));
    }
  }
  return std::isfinite(nearest) && extent.area < kSmallShare * 4 * kPiDouble * nearest * nearest;
}

bool reaches(const SpotLight& light, const Regions& regions) {
  const double cutoff = light.cutoff_degrees * kPiDouble / 180;
  const auto vector = [](const Point3d& v) { return Vec3d(v[0], v[1], v[2]); };
  return regions.empty() || std::ranges::any_of(regions, [&](const Region& region) {
           const auto* const extent = std::get_if<Extent>(&region.shape);
           if (extent == nullptr) {
             return true;
           }
           const Vec3d way = extent->center - vector(light.position);
           const double distance = glm::length(way), radius = extent->radius + light.radius;
           if (distance <= radius) {
             return true;
           }
           const double off_axis =
               std::acos(std::clamp(glm::dot(glm::normalize(vector(light.direction)), way / distance), -1.0, 1.0));
           return off_axis - std::asin(radius / distance) <= cutoff;
         });
}

}  // namespace lightmill
