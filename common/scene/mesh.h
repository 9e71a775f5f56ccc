// A triangle mesh in memory, and its asset form: one canonical binary encoding that is hashed, uploaded and cached.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "common/base/digest.h"
#include "common/base/status.h"

namespace lightmill {

/// An indexed triangle mesh. Counter-clockwise seen from outside: the geometric normal is (p1−p0)×(p2−p0).
struct Mesh {
  std::vector<std::array<double, 3>> positions;
  std::vector<std::array<float, 3>> normals;  ///< empty (flat), or one unit vector per position
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

/// Checks sizes, index ranges and finiteness, and that there is at least one triangle. Degenerate triangles are
/// allowed. Errors name the entry, as in "triangles[7]: …".
Status validate(const Mesh& mesh);

/// The asset bytes of a mesh, little-endian: the characters "LMM1", then three uint32 (1 if there are normals, else 0;
/// the number of positions; the number of triangles), then positions (3 float64 each), normals (3 float32 each, if any)
/// and triangles (3 uint32 each), and nothing after them. Meshes of equal bits give equal bytes. The mesh must be
/// valid.
std::string encode_mesh(const Mesh& mesh);

/// The inverse; validates, so hostile bytes give an error and never a crash.
Result<Mesh> decode_mesh(ByteView bytes);

}  // namespace lightmill
