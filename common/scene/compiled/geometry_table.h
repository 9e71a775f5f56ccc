// The data of each shape that the ray hierarchy does not have: enough to turn a hit into a surface.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <glm/mat3x3.hpp>

#include "common/geometry/ray.h"
#include "common/math/column.h"
#include "common/scene/mesh.h"

namespace lightmill {

/// The surface at eight hits.
struct Surface8 {
  V8 point;
  V8 geometric_normal;  ///< unit, as the shape is oriented (outward)
  V8 shading_normal;    ///< unit, on the same side as the geometric one
  M8 front;             ///< the ray came from the side of the geometric normal
  F8 offset;            ///< distance to move off the surface before tracing on
  U8 material;          ///< index of the material
  F8 u, v;              ///< texture coordinates if the material has textures, else 0
  F8 footprint;         ///< length in texture coordinates over which colours are averaged; 0 unless a method sets it
  V8 color;             ///< of the mesh's vertices, in scenes with such meshes (has_colors)
  F8 alpha;             ///< of the mesh's vertices, in scenes with such meshes
  M8 mapped;            ///< a normal map or bump map gives the shading normal, whatever the ray's direction
  V8 tangent;           ///< of directed surfaces: the direction of the anisotropy; unit, on the shading normal's plane
  M8 directed;          ///< the anisotropy has a direction (anisotropy_directions.h)
};

/// The derivatives of the surface's point by its texture coordinates at eight hits. 0 if there are none.
struct Tangents8 {
  V8 u, v;
};

/// Uses that a material has for the tangents of its surfaces.
struct TangentUse {
  bool normals = false;     ///< for a normal map or bump map
  bool anisotropy = false;  ///< for the direction
  bool any() const { return normals || anisotropy; }
};

/// One row per geometry, in the order of Accel's indices. Built by its adds, then immutable.
class GeometryTable {
  static constexpr std::uint32_t kNone = 0xffffffff;

 public:
  /// The first rows of a mesh.
  struct MeshRows {
    std::uint32_t extents = 0;      ///< first triangle in triangle_extent_
    std::uint32_t corners = 0;      ///< first triangle in corners_
    std::uint32_t normals = 0;      ///< first vertex in vertex_normals_, or kNone
    std::uint32_t coordinates = 0;  ///< first vertex in texture_coordinates_, or kNone
    std::uint32_t colors = 0;       ///< first vertex in vertex_colors_, or kNone
    // For materials that use tangents:
    std::uint32_t derivatives = kNone;  ///< first triangle in derivatives_, or kNone
    std::uint32_t tangents = kNone;     ///< first vertex in vertex_tangents_, or kNone

    MeshRows without_tangents() const { return {extents, corners, normals, coordinates, colors}; }
  };

  void add_sphere(std::uint32_t material, const Vec3& center, float radius, bool normal_inward);
  /// Texture coordinates are distances along the tangents times `coordinate_scale`. They are not needed without
  /// `textured`.
  void add_plane(std::uint32_t material, const Vec3& point, float coordinate_scale, bool textured, TangentUse use);
  void add_mesh(std::uint32_t material, const MeshRows& mesh, TangentUse use);
  /// A mesh under an affine map: `linear` maps differences of its coordinates to the frame, `normal` its normals.
  void add_instance(std::uint32_t material, const MeshRows& mesh, TangentUse use, const glm::mat3& linear,
                    const glm::mat3& normal);

  /// Adds the rows for meshes and their instances. `positions` are the mesh's, in the coordinates in which rays are
  /// traced. `tangents`: some material of the mesh uses them.
  MeshRows add_rows(const Mesh& mesh, const std::vector<std::array<float, 3>>& positions, bool textured, bool tangents);

  /// Surfaces at the hits: unit normals, a point on the surface, the material. Ray directions must be unit vectors.
  Surface8 surface(const Ray8& rays, const Hit8& hits) const;

  bool has_colors() const { return has_colors_; }
  U8 material(U8 geometry, M8 lanes) const { return material_.at(geometry, lanes); }
  /// Texture coordinates per unit of length, in the direction with the fewest. 0 where the surface has none, or no area.
  F8 coordinates_per_length(const Hit8& hits, M8 lanes) const;
  /// By texture coordinates alone.
  Tangents8 derivatives(const Hit8& hits, const Surface8& surface, M8 lanes) const;
  /// Replaces the directions by the mesh's own tangents, where it has some.
  void use_vertex_tangents(const Hit8& hits, const Surface8& surface, M8 lanes, Tangents8& tangents) const;

  std::uint64_t bytes() const;

 private:
  enum Shape : std::uint32_t { kMesh, kSphere, kPlane, kInstance };

  M8 is_shape(Shape shape, U8 geometry, M8 lanes) const { return lanes & (shape_.at(geometry, lanes) == U8(shape)); }
  void add_extent(const Vec3& extent, float coordinates_per_length = 0);
  void push(Shape shape, std::uint32_t material, const MeshRows& mesh, TangentUse use = {},
            const Vec3& center = Vec3(0), float radius = 0, bool inward = false, const glm::mat3& linear = glm::mat3(1),
            const glm::mat3& normal = glm::mat3(1));
  void put_back_onto_spheres(const Hit8& hits, M8 lanes, Surface8& s, V8& magnitude) const;
  void put_back_onto_planes(const Hit8& hits, M8 lanes, Surface8& s) const;
  void interpolate_normals(const Ray8& rays, const Hit8& hits, M8 instances, Surface8& s) const;
  void find_texture_coordinates(const Hit8& hits, Surface8& s) const;
  void interpolate_colors(const Hit8& hits, Surface8& s) const;
  void add_derivatives(const Mesh& mesh, const std::vector<std::array<float, 3>>& positions);
  /// The three indices of the hit triangles' corners in an array that begins at `first`.
  std::array<U8, 3> corners(const Hit8& hits, U8 first, M8 lanes) const;

  bool has_spheres_ = false;
  bool has_planes_ = false;
  bool has_instances_ = false;
  bool has_normals_ = false;
  bool has_coordinates_ = false;
  bool has_colors_ = false;
  bool has_mapped_normals_ = false;
  bool has_directions_ = false;

  // One entry per geometry.
  Column<std::uint32_t> shape_;
  Column<std::uint32_t> material_;
  Column<std::uint32_t> inward_;  ///< spheres with a normal towards the centre
  Column<std::uint32_t> extents_, first_corner_, first_normal_, first_coordinate_, first_color_;  ///< MeshRows
  Column<std::uint32_t> first_derivative_, first_tangent_;  ///< MeshRows; planes: 0 or kNone
  Column<std::uint32_t> mapped_, directed_;                 ///< 0 or 1: TangentUse, where there are derivatives
  VectorColumn center_;                                     ///< of a sphere; a plane's point
  Column<float> radius_;                                    ///< of a sphere; a plane's coordinate scale
  std::vector<float> linear_, normal_matrix_;               ///< of instances, 9 each, by columns
  Column<float> length_scale_;  ///< of instances: the largest by which linear_ scales lengths

  std::vector<float> triangle_extent_;      ///< 4 per triangle: sizes along x, y and z, coordinates_per_length
  std::vector<std::uint32_t> corners_;      ///< 3 vertices per triangle, of meshes with normals, coordinates or colours
  std::vector<float> vertex_normals_;       ///< 3 each
  std::vector<float> texture_coordinates_;  ///< 2 each
  std::vector<float> vertex_colors_;        ///< 4 each
  std::vector<float> derivatives_;          ///< 8 per triangle: by u and a 0, by v and a 0
  std::vector<float> vertex_tangents_;      ///< 4 each, as in Mesh
};

}  // namespace lightmill
