// Reader of PLY meshes (Turk 1994): ASCII, and binary of both byte orders.
#pragma once

#include <string>
#include <string_view>

#include "common/scene/mesh.h"

namespace lightmill {

/// The faces of a file as triangles, in its order. Polygons are cut (polygon.h). Vertices may have normals (nx, ny, nz)
/// and texture coordinates (u, v, or s, t, or texture_u, texture_v). v grows upwards. If a normal has no length, the
/// mesh has no normals. Other elements and properties are skipped. The mesh is valid. Errors begin with the file's
/// name.
Result<Mesh> read_ply(std::string_view bytes, const std::string& file_name);

}  // namespace lightmill
