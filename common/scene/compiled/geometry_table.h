// What is known of each shape beyond what the ray hierarchy holds: enough to complete a hit to a surface.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "common/geometry/ray.h"
#include "common/math/vec.h"
#include "common/scene/mesh.h"

namespace lightmill {

/// What is known of the surface at eight hits.
struct Surface8 {
  V8 point;
  V8 geometric_normal;  ///< unit, as the shape is oriented (outward)
  V8 shading_normal;    ///< unit, on the same side as the geometric one
  M8 front;             ///< the ray came from the side that the geometric normal points to
  F8 offset;            ///< how far to move off the surface before tracing on
  U8 material;          ///< index of the material
};

/// One row a geometry, in the order of Accel's indices. Built by its adds, then immutable.
class GeometryTable {
 public:
  void add_sphere(std::uint32_t material, const Vec3& center, float radius, bool normal_inward);
  /// `positions` are the mesh's in the frame to render in.
  void add_mesh(std::uint32_t material, const Mesh& mesh, const std::vector<std::array<float, 3>>& positions);

  /// Completes hits: unit normals, a point on the surface, the material. Ray directions are unit vectors.
  Surface8 surface(const Ray8& rays, const Hit8& hits) const;

  M8 is_sphere(U8 geometry, M8 lanes) const {
    return has_spheres_ ? lanes & (gather(is_sphere_.data(), geometry, lanes) == U8(1u)) : M8();
  }
  V8 sphere_center(U8 geometry, M8 lanes) const { return gather3(sphere_center_.data(), geometry, lanes); }
  F8 sphere_radius(U8 geometry, M8 lanes) const { return gather(sphere_radius_.data(), geometry, lanes); }
  std::uint64_t bytes() const;

 private:
  void push(std::uint32_t material);
  V8 interpolated_normal(const Hit8& hits, M8 lanes) const;

  bool has_spheres_ = false;
  bool has_smooth_meshes_ = false;

  std::vector<std::uint32_t> material_;
  std::vector<std::uint32_t> is_sphere_;
  std::vector<std::uint32_t> inward_;            ///< spheres whose normal points to the centre
  std::vector<std::uint32_t> smooth_;            ///< meshes with normals
  std::vector<std::uint32_t> triangles_;         ///< first triangle in triangle_extent_
  std::vector<std::uint32_t> smooth_triangles_;  ///< first triangle in corners_
  std::vector<float> sphere_center_;             ///< 3 each
  std::vector<float> sphere_radius_;

  std::vector<float> triangle_extent_;  ///< sizes along x, y and z, 3 a triangle of any mesh

  // Smooth meshes only.
  std::vector<std::uint32_t> corners_;  ///< 3 indices a triangle into vertex_normals_
  std::vector<float> vertex_normals_;   ///< 3 each
};

}  // namespace lightmill
