// A scene ready to be rendered: recentred (and rescaled where it is very large or small), indexed, with only the
// features that are there. Immutable and thread-safe.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "common/geometry/ray.h"
#include "common/lights/light_table.h"
#include "common/math/vec.h"
#include "common/sampling/filter_table.h"
#include "common/scene/accel/accel.h"
#include "common/scene/document.h"
#include "common/scene/mesh.h"

namespace lightmill {

enum class MaterialKind : std::uint32_t { diffuse = 0, mirror = 1, dielectric = 2 };

/// What is known of the surface at eight hits.
struct Surface8 {
  V8 point;
  V8 geometric_normal;  ///< unit, as the shape is oriented (outward)
  V8 shading_normal;    ///< unit, on the same side as the geometric one
  M8 front;             ///< the ray came from the side that the geometric normal points to
  F8 offset;            ///< how far to move off the surface before tracing on
  U8 material;          ///< index of the material
};

/// The camera's basis: a primary ray through film position (x, y) in pixels has direction
/// forward + right · ((x − width/2)) + down · ((y − height/2)).
struct CameraBasis {
  Vec3 eye;      ///< in the recentred frame
  Vec3 forward;  ///< unit
  Vec3 right;    ///< one pixel to the right on the plane at distance 1
  Vec3 down;     ///< one pixel down
};

/// What the scene has; methods skip what it lacks.
struct SceneFeatures {
  bool specular = false;  ///< mirror or dielectric
  bool dielectric = false;
  bool smooth = false;  ///< meshes with vertex normals
  bool spheres = false;
  bool emissive_surfaces = false;
  bool lights = false;  ///< anything that next-event estimation can sample
};

class CompiledScene {
 public:
  /// Gives the encoded mesh of an asset.
  using AssetSource = std::function<Result<std::string>(const Sha256&)>;

  /// Compiles a valid document. Fails when an asset is missing or damaged, or memory runs out; errors name the object.
  static Result<std::shared_ptr<const CompiledScene>> compile(const Scene& scene, const AssetSource& assets);

  const Accel& accel() const { return *accel_; }
  const LightTable& lights() const { return lights_; }
  const CameraBasis& camera() const { return camera_; }
  const FilterTable& filter() const { return *filter_; }
  const SceneFeatures& features() const { return features_; }
  int film_width() const { return film_width_; }
  int film_height() const { return film_height_; }
  /// Rough size in memory.
  std::uint64_t bytes() const { return bytes_; }

  /// Completes hits: unit normals, a point on the surface, the material. `direction` is a unit vector.
  Surface8 surface(const Ray8& rays, const Hit8& hits) const;

  // Materials, by Surface8::material.
  M8 is_kind(U8 material, MaterialKind kind, M8 lanes) const {
    return lanes & (gather(material_kind_.data(), material, lanes) == U8(static_cast<std::uint32_t>(kind)));
  }
  V8 reflectance(U8 material, M8 lanes) const { return gather3(material_reflectance_.data(), material, lanes); }
  F8 ior(U8 material, M8 lanes) const { return gather(material_ior_.data(), material, lanes); }
  /// Which hits see emitted light, given the side that was hit.
  M8 emits(const Surface8& surface, M8 lanes) const;
  V8 emission(U8 material, M8 lanes) const { return gather3(material_emission_.data(), material, lanes); }

  /// With which density per solid angle next-event estimation from `from` would have found this hit of an emissive
  /// surface.
  F8 light_pdf_solid_angle(const V8& from, const Hit8& hits, F8 cos_light, M8 lanes) const;

 private:
  friend class SceneCompiler;
  CompiledScene() = default;

  std::unique_ptr<Accel> accel_;
  LightTable lights_;
  CameraBasis camera_;
  std::unique_ptr<FilterTable> filter_;
  SceneFeatures features_;
  int film_width_ = 0, film_height_ = 0;
  std::uint64_t bytes_ = 0;

  // One entry a material (3 for colours).
  std::vector<std::uint32_t> material_kind_;
  std::vector<std::uint32_t> material_emits_;  ///< 0 never, 1 on the front, 2 on both sides
  std::vector<float> material_reflectance_, material_emission_, material_ior_;

  // One entry a geometry, in the order of Accel's indices.
  std::vector<std::uint32_t> geometry_material_;
  std::vector<std::uint32_t> geometry_is_sphere_;
  std::vector<std::uint32_t> geometry_inward_;            ///< spheres whose normal points to the centre
  std::vector<std::uint32_t> geometry_smooth_;            ///< meshes with normals
  std::vector<std::uint32_t> geometry_triangles_;         ///< first triangle in triangle_extent_
  std::vector<std::uint32_t> geometry_smooth_triangles_;  ///< first triangle in smooth_triangles_
  std::vector<float> sphere_center_;                      ///< 3 each
  std::vector<float> sphere_radius_;
  std::vector<float> emitter_pdf_area_;     ///< meshes: light choice included
  std::vector<float> emitter_probability_;  ///< spheres: of the light

  std::vector<float> triangle_extent_;  ///< sizes along x, y and z, 3 a triangle of any mesh

  // Smooth meshes only.
  std::vector<std::uint32_t> smooth_triangles_;  ///< 3 indices each into vertex_normals_
  std::vector<float> vertex_normals_;            ///< 3 each
};

}  // namespace lightmill
