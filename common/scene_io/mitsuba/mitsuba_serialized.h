// Reader of Mitsuba's serialized meshes, versions 3 and 4.
#pragma once

#include <string>
#include <string_view>

#include "common/scene/mesh.h"

namespace lightmill {

/// Limits of what a scene's compressed meshes unpack to.
struct SerializedBudget {
  std::uint64_t bytes = std::uint64_t{4} << 30;
};

struct SerializedMesh {
  Mesh mesh;                  ///< valid. If a normal has no length, it has none
  bool face_normals = false;  ///< the file asks for a flat mesh
};

/// Mesh number `index` of a file, from 0. Vertices may have normals and texture coordinates, whose v grows as in the
/// file. Vertex colours are skipped. Errors begin with the file's name.
Result<SerializedMesh> read_serialized(std::string_view bytes, const std::string& file_name, std::size_t index,
                                       SerializedBudget& budget);

}  // namespace lightmill
