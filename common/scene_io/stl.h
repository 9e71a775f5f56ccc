// Reader of STL meshes (3D Systems 1989): ASCII and binary.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "common/scene/mesh.h"

namespace lightmill {

/// The triangles of a file, in its order. Corners at the same place are one vertex. The mesh is flat: the file's normals
/// repeat what the corners say, and are often wrong. A binary file may begin with "solid", as an ASCII file does: its
/// size decides. `notices` gets what was left out. Errors begin with the file's name.
Result<Mesh> read_stl(std::string_view bytes, const std::string& file_name, std::vector<std::string>& notices);

}  // namespace lightmill
