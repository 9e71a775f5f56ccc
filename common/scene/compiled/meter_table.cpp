#include "common/scene/compiled/meter_table.h"

#include <algorithm>
#include <cmath>

#include "common/scene/compiled/convert.h"
#include "common/scene/compiled/mesh_sources.h"

namespace lightmill {
namespace {

/// A meter's place in the frame: a point, or a parallelogram.
struct MeterFootprint {
  Vec3d corner{0}, edge1{0}, edge2{0};

  std::array<Vec3d, 4> corners() const { return {corner, corner + edge1, corner + edge2, corner + edge1 + edge2}; }
  /// The point of the footprint that is nearest to p.
  Vec3d nearest(const Vec3d& p) const;
  /// The sum of the magnitudes in its coordinates.
  Vec3d sizes() const { return glm::abs(corner) + glm::abs(edge1) + glm::abs(edge2); }
};

/// Half of the relative distance of surface_offset. A meter within it of a surface is on the surface, and is moved
/// clear of it.
constexpr double kReach = 0x1p-20;

double reach(const Vec3d& normal, const Vec3d& magnitude) {
  return kReach * glm::dot(glm::abs(normal), magnitude);
}

/// Whether any point of the footprint is within reach of the plane through `point`.
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

/// A search for the surfaces that pass through a meter's place, and for their precision. It keeps references to its
/// arguments.
class MeterSurfaces {
 public:
  MeterSurfaces(const Scene& scene, const ObjectMeshes& meshes, const std::vector<Affine>& maps,
                const std::vector<Bounds>& bounds, const WorldFrame& frame)
      : scene_(scene), meshes_(meshes), maps_(maps), bounds_(bounds), frame_(frame) {}

  /// The magnitudes in the coordinates of hits near a meter on a surface. They are those of the meter, and of surfaces
  /// that pass through it within rounding. Zero for a meter on no surface. Its estimates begin at its place.
  Vec3d magnitude(const MeterFootprint& footprint) const;

 private:
  Vec3d to_frame(std::size_t object, const Vec3d& p) const { return frame_.to_frame(maps_[object](p)); }
  Vec3d on_sphere(std::size_t object, const SphereShape& sphere, const MeterFootprint& footprint) const;
  Vec3d on_plane(std::size_t object, const PlaneShape& plane, const MeterFootprint& footprint) const;
  Vec3d on_mesh(std::size_t object, const MeterFootprint& footprint) const;

  const Scene& scene_;
  const ObjectMeshes& meshes_;
  const std::vector<Affine>& maps_;
  const std::vector<Bounds>& bounds_;
  const WorldFrame& frame_;
};

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

/// The unit vector of a vector of any length except zero.
Vec3d unit(const Vec3d& v) {
  const Vec3d near_one = v / std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
  return glm::normalize(near_one);
}

}  // namespace

MeterTable compile_meters(const Scene& scene, const ObjectMeshes& meshes, const std::vector<Affine>& maps,
                          const std::vector<Bounds>& bounds, const WorldFrame& frame) {
  const MeterSurfaces surfaces(scene, meshes, maps, bounds, frame);
  MeterTable table;
  for (const Meter& meter : scene.meters) {
    CompiledMeter compiled;
    Vec3d corner, edge1(0), edge2(0), direction;
    if (const Patch* patch = patch_of(meter)) {
      corner = frame.to_frame(to_vec(patch->corner));
      edge1 = to_vec(patch->edge1) * frame.scale();
      edge2 = to_vec(patch->edge2) * frame.scale();
      direction = unit(glm::cross(unit(edge1), unit(edge2)));
    } else if (const auto* point = std::get_if<IrradianceMeter>(&meter.kind)) {
      corner = frame.to_frame(to_vec(point->point));
      direction = unit(to_vec(point->normal));
    } else {
      const auto& ray = std::get<RadianceMeter>(meter.kind);
      compiled.measures_radiance = true;
      corner = frame.to_frame(to_vec(ray.point));
      direction = unit(to_vec(ray.direction));
    }
    compiled.corner = Vec3(corner);
    compiled.edge1 = Vec3(edge1);
    compiled.edge2 = Vec3(edge2);
    compiled.direction = Vec3(direction);
    if (!compiled.measures_radiance) {
      compiled.magnitude = Vec3(surfaces.magnitude({corner, edge1, edge2}));
    }
    table.push_back(compiled);
  }
  return table;
}

}  // namespace lightmill
