// Ray intersection with every triangle and sphere in turn, without a hierarchy. It is the reference for results of the
// hierarchy, and the baseline of its speed.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "common/geometry/ray.h"

namespace lightmill {

/// Built by its adds, then immutable. Planes are handled by the caller.
class BruteForce {
 public:
  using Positions = std::span<const std::array<float, 3>>;
  using Triangles = std::span<const std::array<std::uint32_t, 3>>;

  void add_mesh(std::uint32_t geometry, Positions positions, Triangles triangles);
  /// Returns the number of the mesh for add_instance.
  std::uint32_t add_prototype(Positions positions, Triangles triangles);
  void add_instance(std::uint32_t geometry, std::uint32_t prototype,
                    const std::array<std::array<float, 4>, 3>& to_scene);
  void add_sphere(std::uint32_t geometry, const Vec3& center, float radius);

  /// As in Accel: the nearest hit, the first of several at one distance.
  Hit8 intersect(M8 lanes, const Ray8& rays, F8 min_distance) const;
  M8 occluded(M8 lanes, const Ray8& rays) const;

 private:
  struct Triangle {
    Vec3 corner, edge1, edge2, normal;  ///< edge1 = corner − second corner, edge2 = third corner − corner
  };
  using TriangleList = std::vector<Triangle>;
  struct Mesh {
    std::uint32_t geometry;
    std::shared_ptr<const TriangleList> triangles;
    bool mapped;  ///< rays are mapped to the mesh's coordinates by
    std::array<Vec3, 3> inverse_columns;
    Vec3 origin;
  };
  struct Sphere {
    std::uint32_t geometry;
    Vec3 center;
    float radius;
  };
  static std::shared_ptr<const TriangleList> list_of(Positions positions, Triangles triangles);
  static Ray8 to_mesh(const Mesh& mesh, const Ray8& rays);
  static M8 try_triangle(const Triangle& triangle, const Ray8& rays, F8 min_distance, M8 lanes, Hit8& hit);
  static M8 try_sphere(const Sphere& sphere, const Ray8& rays, F8 min_distance, M8 lanes, Hit8& hit);

  std::vector<Mesh> meshes_;
  std::vector<Sphere> spheres_;
  std::vector<std::shared_ptr<const TriangleList>> prototypes_;
};

}  // namespace lightmill
