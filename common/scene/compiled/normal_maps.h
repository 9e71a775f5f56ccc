// Shading normals by the normal maps and bump maps of a scene's materials.
#pragma once

#include "common/materials/texture.h"
#include "common/math/column.h"
#include "common/scene/compiled/geometry_table.h"
#include "common/scene/compiled/material_rows.h"

namespace lightmill {

/// One row per material. Immutable.
///
/// The tangent frame has the interpolated normal n. Its tangent is the direction of u, made perpendicular to n. Its
/// bitangent is n × tangent, on the side of v. The direction of u is the mesh's tangent, or that of the triangle's
/// texture coordinates. MikkTSpace ("Simulation of Wrinkled Surfaces Revisited", Mikkelsen 2008) gives the same frame
/// for triangles in a plane. Elsewhere it averages the directions of neighbouring triangles, and we do not.
///
/// A bump map of height h gives n − ∇h, with the gradient on the surface (Mikkelsen 2010, "Bump Mapping Unparametrized
/// Surfaces on the GPU").
class NormalMaps {
 public:
  NormalMaps() = default;
  /// `length_scale`: of the frame over scene units.
  NormalMaps(const Scene& scene, const MaterialRows& rows, double length_scale);

  /// Sets the shading normals of `surface.mapped`. They stay on the side of the geometric normal, at an angle of at
  /// most acos(kMinCosine).
  void apply(const GeometryTable& geometry, const TextureSet& textures, const Hit8& hits, Surface8& surface) const;

  static constexpr float kMinCosine = 0.05f;

 private:
  V8 normals(const TextureSet& textures, const Tangents8& tangents, const Surface8& surface, M8 lanes) const;
  V8 bumps(const TextureSet& textures, const Tangents8& tangents, const Surface8& surface, M8 lanes) const;

  Column<std::uint32_t> normals_, heights_;  ///< textures, or TextureSet::kNone
  Column<float> scale_u_, scale_v_;          ///< of a normal map's parts
  Column<float> cosine_, sine_;              ///< of its rotation
  Column<std::uint32_t> channel_;            ///< of heights
  Column<float> height_;                     ///< in the frame
};

}  // namespace lightmill
