// Reader of PLY meshes (Turk 1994): ASCII, and binary of both byte orders.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "common/scene/mesh.h"

namespace lightmill {

/// The faces of a file as triangles, in its order. Polygons are cut (polygon.h). Vertices may have normals (nx, ny, nz)
/// and texture coordinates (u, v, or s, t, or texture_u, texture_v). v grows upwards. If a normal has no length, the
/// mesh has no normals. Other elements and properties are skipped. The mesh is valid. Errors begin with the file's
/// name. With `notices`, vertices may also have colours (red, green, blue, sRGB-encoded: whole numbers of 8 or 16 bits,
/// or from 0 to 1, or to 255 if some are above 1), and `notices` gets what was left out.
Result<Mesh> read_ply(std::string_view bytes, const std::string& file_name,
                      std::vector<std::string>* notices = nullptr);

}  // namespace lightmill
