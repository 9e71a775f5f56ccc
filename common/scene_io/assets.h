// What a scene's files leave among its assets.
#pragma once

#include <filesystem>

#include "common/scene/mesh.h"
#include "common/scene_io/load.h"
#include "common/scene_io/obj.h"

namespace lightmill {

/// Encodes a mesh and keeps it. An error says what is wrong with the mesh.
Result<Sha256> add_mesh(const Mesh& mesh, LoadedScene& loaded);

/// Keeps the bytes of a file as they are, as those of images are.
Sha256 add_bytes(std::string bytes, LoadedScene& loaded);

/// Reads a file of at most `max_bytes` and keeps its bytes as they are. An error names the file.
Result<Sha256> add_file(const std::filesystem::path& path, std::uint64_t max_bytes, LoadedScene& loaded);

/// Reads an OBJ file of at most 4 GiB.
Result<ObjFile> read_obj_file(const std::filesystem::path& path);

/// Adds those notices that are not there yet.
void append_notices(const std::vector<std::string>& from, std::vector<std::string>& to);

}  // namespace lightmill
