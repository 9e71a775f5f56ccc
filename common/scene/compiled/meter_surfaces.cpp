#include "common/scene/compiled/meter_surfaces.h"

#include <algorithm>
#include <cmath>

#include "common/scene/compiled/convert.h"

namespace lightmill {
namespace {

/// Half of the relative distance of surface_offset. A meter within it of a surface is on the surface, and is moved
/// clear of it.
constexpr double kReach = 0x1p-20;

double reach(const Vec3d& normal, const Vec3d& magnitude) {
  return kReach * glm::dot(glm::abs(normal), magnitude);
}

/// Whether any point of the spot is within reach of the plane through `point`.
bool touches_plane(const MeterFootprint& footprint, const Vec3d& point, const Vec3d& normal, const Vec3d& magnitude) {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const Vec3d& corner : footprint.corners()) {
    const double height = glm::dot(normal, corner - point);
    low = std::min(low, height);
    high = std::max(high, height);
  }
  const double hair = reach(normal, magnitude);
  return low <= hair && high >= -hair;
}

bool touches_box(const MeterFootprint& footprint, const Bounds& box, const Vec3d& magnitude) {
  Bounds own;
  for (const Vec3d& corner : footprint.corners()) {
    own.add(corner);
  }
  const Vec3d hair = magnitude * (2 * kReach);
  return glm::all(glm::lessThanEqual(own.low - hair, box.high)) &&
         glm::all(glm::greaterThanEqual(own.high + hair, box.low));
}

/// The point of a segment that is nearest to p.
Vec3d nearest_on_segment(const Vec3d& begin, const Vec3d& edge, const Vec3d& p) {
  const double length2 = glm::dot(edge, edge);
  return length2 > 0 ? begin + edge * std::clamp(glm::dot(p - begin, edge) / length2, 0.0, 1.0) : begin;
}

}  // namespace

Vec3d MeterFootprint::nearest(const Vec3d& p) const {
  const Vec3d normal = glm::cross(edge1, edge2), way = p - corner;
  const double area2 = glm::dot(normal, normal);
  const double u = glm::dot(glm::cross(way, edge2), normal), v = glm::dot(glm::cross(edge1, way), normal);
  if (area2 > 0 && u >= 0 && u <= area2 && v >= 0 && v <= area2) {
    return corner + edge1 * (u / area2) + edge2 * (v / area2);
  }
  Vec3d best = corner;
  for (const Vec3d& q : {nearest_on_segment(corner, edge1, p), nearest_on_segment(corner, edge2, p),
                         nearest_on_segment(corner + edge1, edge2, p), nearest_on_segment(corner + edge2, edge1, p)}) {
    best = glm::length(q - p) < glm::length(best - p) ? q : best;
  }
  return best;
}

Vec3d MeterSurfaces::magnitude(const MeterFootprint& footprint) const {
  Vec3d most(0);
  for (std::size_t i = 0; i < scene_.objects.size(); ++i) {
    if (const auto* sphere = std::get_if<SphereShape>(&scene_.objects[i].shape)) {
      most = glm::max(most, on_sphere(i, *sphere, footprint));
    } else if (const auto* plane = std::get_if<PlaneShape>(&scene_.objects[i].shape)) {
      most = glm::max(most, on_plane(i, *plane, footprint));
    } else {
      most = glm::max(most, on_mesh(i, footprint));
    }
  }
  return most;
}

Vec3d MeterSurfaces::on_sphere(std::size_t object, const SphereShape& sphere, const MeterFootprint& footprint) const {
  const Vec3d center = to_frame(object, to_vec(sphere.center));
  const double radius = sphere.radius * maps_[object].similarity_scale() * frame_.scale();
  const Vec3d magnitude = footprint.sizes() + Vec3d(radius);
  double farthest = 0;
  for (const Vec3d& corner : footprint.corners()) {
    farthest = std::max(farthest, glm::length(corner - center));
  }
  const Vec3d way = footprint.nearest(center) - center;
  const double nearest = glm::length(way);
  const double hair = nearest > 0 ? reach(way / nearest, magnitude) : 0;
  return nearest <= radius + hair && farthest >= radius - hair ? magnitude : Vec3d(0);
}

Vec3d MeterSurfaces::on_plane(std::size_t object, const PlaneShape& plane, const MeterFootprint& footprint) const {
  const Vec3d point = to_frame(object, to_vec(plane.point));
  const Vec3d normal = glm::normalize(near_one(maps_[object].normal_matrix() * near_one(to_vec(plane.normal))));
  const Vec3d magnitude = footprint.sizes() + glm::abs(point);
  return touches_plane(footprint, point, normal, magnitude) ? magnitude : Vec3d(0);
}

Vec3d MeterSurfaces::on_mesh(std::size_t object, const MeterFootprint& footprint) const {
  Bounds box;
  box.add(frame_.to_frame(bounds_[object].low));
  box.add(frame_.to_frame(bounds_[object].high));
  const Vec3d whole = glm::max(glm::abs(box.low), glm::abs(box.high));
  if (!touches_box(footprint, box, footprint.sizes() + whole)) {
    return Vec3d(0);
  }
  const Mesh& mesh = *meshes_.of_object[object];
  Vec3d most(0);
  for (const auto& t : mesh.triangles) {
    Bounds triangle;
    std::array<Vec3d, 3> corner;
    for (int i = 0; i < 3; ++i) {
      const auto& p = mesh.positions[t[static_cast<std::size_t>(i)]];
      corner[static_cast<std::size_t>(i)] = to_frame(object, Vec3d(p[0], p[1], p[2]));
      triangle.add(corner[static_cast<std::size_t>(i)]);
    }
    // Rays are mapped to an instance's own coordinates. The precision of the map depends on the size of the whole mesh.
    const Vec3d magnitude = footprint.sizes() + triangle.size() + (meshes_.instanced[object] ? whole : Vec3d(0));
    if (!touches_box(footprint, triangle, magnitude)) {
      continue;
    }
    const Vec3d normal = glm::cross(corner[1] - corner[0], corner[2] - corner[0]);
    const double length = glm::length(normal);
    if (length > 0 && touches_plane(footprint, corner[0], normal / length, magnitude)) {
      most = glm::max(most, magnitude);
    }
  }
  return most;
}

}  // namespace lightmill
