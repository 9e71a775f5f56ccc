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

inline constexpr std::uint32_t kNoNormal = 0xffffffffu;

/// A corner of a triangle: indices into the file's positions and normals.
struct ObjCorner {
  std::uint32_t position = 0;
  std::uint32_t normal = kNoNormal;
};
using ObjTriangle = std::array<ObjCorner, 3>;

/// The triangles of one material, in the order of the file.
struct ObjPart {
  std::string material;  ///< as usemtl names it; empty before the first usemtl
  int line = 0;          ///< of the first such usemtl; 0 before the first
  std::vector<ObjTriangle> triangles;
};

/// A file that a mtllib statement names.
struct ObjLibrary {
  std::string file;  ///< as written
  int line = 0;
};

struct ObjFile {
  std::vector<std::array<double, 3>> positions;
  std::vector<std::array<float, 3>> normals;  ///< unit; (0, 0, 0) for one that was given so and means none
  std::vector<ObjPart> parts;                 ///< only those with triangles, in the order of their first usemtl
  std::vector<ObjLibrary> libraries;
  std::vector<std::string> notices;  ///< what was left out, each kind once
};

/// Reads an OBJ file: v, vn, f (v, v/t, v//n, v/t/n, also counted backwards by negative numbers; polygons are cut into
/// fans), usemtl, mtllib; vt, o, g and s say nothing about the geometry and are passed over. Errors read "box.obj:12:
/// what is wrong, what is expected". A file without faces is an error.
Result<ObjFile> read_obj(std::string_view text, const std::string& file_name);

/// One mesh of some parts of a file: flat if no corner has a normal, else smooth, with the faces' own normals at
/// corners without.
Mesh make_mesh(const ObjFile& file, std::span<const ObjPart* const> parts);

}  // namespace lightmill
