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

namespace lightmill {
namespace {

Vec3d placed(const Object& object, const Point3d& p) {
  const Transform& t = object.transform;
  const auto row = [&](std::size_t i) { return t[i][0] * p[0] + t[i][1] * p[1] + t[i][2] * p[2] + t[i][3]; };
  return {row(0), row(1), row(2)};
}

Extent extent_of_all(const std::vector<std::array<Vec3d, 3>>& triangles) {
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

/// Empty for radiance meters, which measure as a camera does.
std::optional<Extent> extent_of_meter(const Meter& meter) {
  const auto vector = [](const Point3d& v) { return Vec3d(v[0], v[1], v[2]); };
  const auto across = [&](const Patch& patch) -> std::optional<Extent> {
    const Vec3d corner = vector(patch.corner), edge1 = vector(patch.edge1), edge2 = vector(patch.edge2);
    return extent_of_all(
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

double Region::distance(const Vec3d& p) const {
  if (const auto* const plane = std::get_if<PlaneShape>(&shape)) {
    const auto vector = [](const Point3d& v) { return Vec3d(v[0], v[1], v[2]); };
    return std::abs(glm::dot(p - vector(plane->point), glm::normalize(vector(plane->normal))));
  }
  const auto& extent = std::get<Extent>(shape);
  const double from_center = glm::length(p - extent.center);
  return hollow ? std::abs(from_center - extent.radius) : std::max(from_center - extent.radius, 0.0);
}

bool Positions::take(std::uint64_t steps) {
  if (steps > kMaxSteps - steps_) {
    return false;
  }
  steps_ += steps;
  return true;
}

const Mesh* Positions::mesh(const Sha256& asset) {
  const auto [at, is_new] = decoded_.try_emplace(asset);
  if (is_new && meshes_.bytes && take(MeshSource::kMaxBytes / 2)) {
    const std::optional<std::string> bytes = meshes_.bytes(asset);
    steps_ -= (MeshSource::kMaxBytes - std::min(bytes ? bytes->size() : 0, MeshSource::kMaxBytes)) / 2;
    if (bytes && bytes->size() <= MeshSource::kMaxBytes) {
      if (Result<Mesh> mesh = decode_mesh(as_byte_view(*bytes)); mesh.ok()) {  // rendering reports the error
        at->second = *std::move(mesh);
      }
    }
  }
  return at->second ? &*at->second : nullptr;
}

std::optional<Extent> Positions::find_extent(const Object& object, const MeshShape& shape) {
  const Mesh* const mesh = this->mesh(shape.asset);
  if (mesh == nullptr || !take(3 * mesh->triangles.size())) {
    return std::nullopt;
  }
  std::vector<std::array<Vec3d, 3>> triangles;
  for (const auto& corners : mesh->triangles) {
    std::array<Vec3d, 3>& triangle = triangles.emplace_back();
    for (std::size_t i = 0; i < 3; ++i) {
      triangle[i] = placed(object, mesh->positions[corners[i]]);
    }
  }
  return extent_of_all(triangles);
}

std::optional<Extent> Positions::find_extent(const Object& object) {
  return std::visit(
      Overloaded{[&](const SphereShape& s) -> std::optional<Extent> {
                   const Vec3d center = placed(object, s.center);
                   const double radius =
                       glm::length(placed(object, {s.center[0] + s.radius, s.center[1], s.center[2]}) - center);
                   return Extent{center, radius, kPiDouble * radius * radius};
                 },
                 [&](const TriangleShape& t) -> std::optional<Extent> {
                   return extent_of_all({{placed(object, t.a), placed(object, t.b), placed(object, t.c)}});
                 },
                 [&](const MeshShape& m) { return find_extent(object, m); },
                 [](const auto&) { return std::optional<Extent>(); }},
      object.shape);
}

const std::optional<Extent>& Positions::extent_of(const Object& object) {
  std::optional<std::optional<Extent>>& known = extents_[static_cast<std::size_t>(&object - scene_.objects.data())];
  if (!known) {
    known = find_extent(object);
  }
  return *known;
}

/// Positions of all objects whose material counts; empty if one is unknown.
template <class Counts>
std::optional<Regions> Positions::regions_of(const Counts& counts) {
  Regions regions;
  for (const Object& object : scene_.objects) {
    if (!counts(scene_.materials[object.material])) {
      continue;
    }
    if (const auto* const plane = std::get_if<PlaneShape>(&object.shape)) {
      if (object.transform != kIdentityTransform) {
        return std::nullopt;
      }
      regions.push_back({*plane, false, &object});
    } else if (const std::optional<Extent>& extent = extent_of(object)) {
      regions.push_back({*extent, std::holds_alternative<SphereShape>(object.shape), &object});
    } else {
      return std::nullopt;
    }
  }
  return regions;
}

Regions Positions::narrow_regions() {
  return regions_of([](const Material& material) { return narrow_lobes(material) != NarrowLobes::none; })
      .value_or(Regions{});
}

Regions Positions::receiver_regions() {
  std::optional<Regions> regions = regions_of(receives_light);
  if (!regions) {
    return {};
  }
  for (const Meter& meter : scene_.meters) {
    if (const std::optional<Extent> extent = extent_of_meter(meter)) {
      regions->push_back({*extent, false, nullptr});
    }
  }
  return *std::move(regions);
}

bool Positions::is_small_from(const Regions& regions, const Object* emitter, const Extent& extent) {
  bool small = false;
  for (const Region& region : regions) {
    if (emitter == nullptr || region.object != emitter) {
      const double distance = region.distance(extent.center);
      small = take(1) && extent.area < kSmallShare * 4 * kPiDouble * distance * distance;
      if (!small) {
        break;
      }
    }
  }
  return small;
}

bool Positions::reaches(const SpotLight& light, const Regions& regions) {
  const double cutoff = light.cutoff_degrees * kPiDouble / 180;
  const auto vector = [](const Point3d& v) { return Vec3d(v[0], v[1], v[2]); };
  return regions.empty() || std::ranges::any_of(regions, [&](const Region& region) {
           const auto* const extent = std::get_if<Extent>(&region.shape);
           if (extent == nullptr || !take(1)) {
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
