// Directions along which anisotropic surfaces are rougher.
#pragma once

#include "common/math/column.h"
#include "common/scene/compiled/geometry_table.h"
#include "common/scene/compiled/material_rows.h"

namespace lightmill {

/// One row per material. Immutable.
///
/// The direction is that of u, made perpendicular to the shading normal and rotated towards v. As for normal maps, u is
/// the mesh's tangent, or the derivative by the triangle's texture coordinates.
class AnisotropyDirections {
 public:
  AnisotropyDirections() = default;
  explicit AnisotropyDirections(const MaterialRows& rows);

  /// Sets the tangents of directed surfaces, and clears `directed` where there is no direction.
  void find(const GeometryTable& geometry, const Hit8& hits, Surface8& surface) const;

 private:
  Column<float> cosine_, sine_;  ///< of the rotation
};

}  // namespace lightmill
