// Reader of Wavefront OBJ: polygon meshes whose faces name materials.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/status.h"
#include "common/scene/mesh.h"
#include "common/scene_io/faults.h"

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
  std::string material;  ///< name in usemtl; empty before the first usemtl
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
  /// Empty, or the linear colours of the first positions. Positions without one are white.
  std::vector<std::array<float, 3>> colors;
  std::vector<std::array<float, 2>> texture_coordinates;
  /// Unit vectors. (0, 0, 0) if the file has that, which means none. Normals of smoothing groups follow those of the
  /// file.
  std::vector<std::array<float, 3>> normals;
  std::vector<ObjPart> parts;  ///< parts with triangles, in the order of their first usemtl
  std::vector<ObjLibrary> libraries;
  std::vector<std::string> notices;  ///< what was assumed or left out, each kind once
};

/// Reads an OBJ file:
/// - v, vt (u and v), vn
/// - colours after the coordinates of v, sRGB-encoded: from 0 to 1, or as whole numbers from 0 to 255
/// - f (v, v/t, v//n, v/t/n; negative numbers count from the end). Polygons are triangulated, also concave ones. A face
///   may refer to later entries.
/// - s: corners without a normal get the mean of the normals of the group's faces there, weighted by their angles
/// - usemtl, mtllib. o and g are skipped, because they only name things.
/// A wrong statement is skipped and added to the faults: "box.obj:12: what is wrong, what is expected". A vertex that
/// cannot be read counts, and faces that use it are skipped. A file without faces that have an area is an error.
Result<ObjFile> read_obj(std::string_view text, const std::string& file_name, Faults& faults);

/// One mesh of some parts of a file. It has one vertex for each combination of position, texture coordinate and normal,
/// in the order of first use. It is flat if no corner has a normal. Else it is smooth, and corners without a normal
/// have that of their face. If any corner has texture coordinates, corners without have (0, 0). It has colours if the
/// file has any.
Mesh make_mesh(const ObjFile& file, std::span<const ObjPart* const> parts);

}  // namespace lightmill
