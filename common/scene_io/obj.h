// Wavefront OBJ: polygon meshes whose faces name materials.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/status.h"
#include "common/scene/mesh.h"

namespace lightmill {

inline constexpr std::uint32_t kNoIndex = 0xffffffffu;

/// A corner of a triangle: indices into the file's positions, texture coordinates and normals.
struct ObjCorner {
  std::uint32_t position = 0;
  std::uint32_t texture = kNoIndex;
  std::uint32_t normal = kNoIndex;
  friend bool operator==(const ObjCorner&, const ObjCorner&) = default;
};
using ObjTriangle = std::array<ObjCorner, 3>;

/// The triangles of one material, in the order of the file.
struct ObjPart {
  std::string material;  ///< as usemtl names it; empty before the first usemtl
  int line = 0;          ///< of the first such usemtl; 0 before the first
  std::vector<ObjTriangle> triangles;
};

/// The argument of a mtllib statement.
struct ObjLibrary {
  std::string file;  ///< as written: a file, or several with blanks between them
  int line = 0;
};

struct ObjFile {
  std::vector<std::array<double, 3>> positions;
  std::vector<std::array<float, 2>> texture_coordinates;
  /// Unit; (0, 0, 0) for one that was given so and means none. Those of smoothing groups follow those of the file.
  std::vector<std::array<float, 3>> normals;
  std::vector<ObjPart> parts;  ///< only those with triangles, in the order of their first usemtl
  std::vector<ObjLibrary> libraries;
  std::vector<std::string> notices;  ///< what was assumed or left out, each kind once
};

/// Reads an OBJ file: v, vt (u and v), vn, f (v, v/t, v//n, v/t/n, also counted backwards by negative numbers; polygons
/// are triangulated, concave ones too), s (corners without a normal in a smoothing group get the mean of the normals
/// that the group's faces have there, weighted by their angles), usemtl, mtllib; o and g only name things and are
/// passed over. Errors read "box.obj:12: what is wrong, what is expected". A file without faces is an error.
Result<ObjFile> read_obj(std::string_view text, const std::string& file_name);

/// One mesh of some parts of a file, with a vertex for each combination of position, texture coordinate and normal in
/// the order of first use. It is flat if no corner has a normal, else smooth, with the faces' own normals at corners
/// without. It has texture coordinates if any corner has, and (0, 0) at corners without.
Mesh make_mesh(const ObjFile& file, std::span<const ObjPart* const> parts);

}  // namespace lightmill
