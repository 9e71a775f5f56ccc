// A triangle mesh in memory, and its asset form: one canonical binary encoding that is hashed, uploaded and cached.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "common/base/digest.h"
#include "common/base/status.h"

namespace lightmill {

inline constexpr float kMaxTextureCoordinate = 1e9f;  ///< of u and v: their integer parts fit into 31 bits

/// An indexed triangle mesh. Triangles are counter-clockwise seen from outside: the geometric normal is
/// (p1−p0)×(p2−p0).
struct Mesh {
  std::vector<std::array<double, 3>> positions;
  std::vector<std::array<float, 3>> normals;  ///< empty (flat), or one unit vector per position
  /// Empty, or one (u, v) per position. u grows to the right of the image and v upwards, as in OBJ files: (0, 0) is the
  /// lower left corner of the image, (1, 1) the upper right one. glTF counts v downwards.
  std::vector<std::array<float, 2>> texture_coordinates;
  /// Empty, or linear red, green, blue and alpha of each position, each in [0, 1]. They multiply a surface's
  /// reflectance and opacity.
  std::vector<std::array<float, 4>> colors;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  /// Empty, or one (x, y, z, sign) per position, for normal maps: the direction of u, a unit vector. That of v is the
  /// sign, 1 or -1, times normal × direction.
  std::vector<std::array<float, 4>> tangents = {};
};

/// Checks sizes, index ranges and finiteness, and that there is at least one triangle. Degenerate triangles are
/// allowed. Errors name the entry, as in "triangles[7]: …".
Status validate(const Mesh& mesh);

/// The asset bytes of a mesh, little-endian, in this order, with nothing after them:
/// - the characters "LMM1"
/// - three uint32: flags (1 for normals, plus 2 for texture coordinates, plus 4 for tangents, plus 8 for colours),
///   number of positions, number of triangles
/// - positions (3 float64 each)
/// - normals (3 float32 each), if any
/// - texture coordinates (2 float32 each), if any
/// - colours (4 float32 each), if any
/// - tangents (4 float32 each), if any
/// - triangles (3 uint32 each)
/// Meshes of equal bits give equal bytes. The mesh must be valid.
std::string encode_mesh(const Mesh& mesh);

/// The inverse. It validates, so hostile bytes give an error and never a crash.
Result<Mesh> decode_mesh(ByteView bytes);

}  // namespace lightmill
