// Objects of a scene document: shape, material and place.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <variant>

#include "common/base/digest.h"
#include "common/scene/document/values.h"

namespace lightmill {

/// An indexed triangle mesh, stored as an asset (common/scene/mesh.h).
struct MeshShape {
  std::string file;  ///< as the document named it; for messages only
  Sha256 asset;      ///< of the encoded mesh
};
struct SphereShape {
  Point3d center{0, 0, 0};
  double radius = 1;
  bool normal_inward = false;  ///< the geometric normal points to the centre (an enclosing, inward-emitting sphere)
};

/// An infinite plane. Texture coordinates are distances from `point` along its tangents (common/math/vec.h, Frame8).
struct PlaneShape {
  Point3d point{0, 0, 0};
  Point3d normal{0, 1, 0};  ///< need not be a unit vector
};
/// Counter-clockwise seen from outside. Texture coordinates are (0, 0), (1, 0) and (0, 1).
struct TriangleShape {
  Point3d a{0, 0, 0}, b{1, 0, 0}, c{0, 1, 0};
};

/// From a shape's own coordinates to the scene's: the upper three rows of a 4×4 matrix that acts on columns.
using Transform = std::array<std::array<double, 4>, 3>;
inline constexpr Transform kIdentityTransform{{{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}}};

struct Object {
  std::string name;
  std::uint32_t material = 0;  ///< index into Scene::materials
  std::variant<MeshShape, SphereShape, PlaneShape, TriangleShape> shape;
  /// Invertible. For a sphere, a similarity. Objects that share a mesh share its memory.
  Transform transform = kIdentityTransform;
};

}  // namespace lightmill
