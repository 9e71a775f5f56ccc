// What a scene's files leave among its assets.
#pragma once

#include <filesystem>

#include "common/scene/mesh.h"
#include "common/scene_io/load.h"
#include "common/scene_io/obj.h"

namespace lightmill {

/// Encodes a mesh and keeps it. An error says what is wrong with the mesh.
Result<Sha256> add_mesh(const Mesh& mesh, LoadedScene& loaded);

/// Keeps the bytes of a file as they are.
Sha256 add_bytes(std::string bytes, LoadedScene& loaded);

/// Keeps the bytes of an image file and notes `image`, whose asset is set here.
Sha256 add_image(std::string bytes, ImageAsset image, LoadedScene& loaded);

/// Reads an image file of at most 1 GiB and keeps it so. An error names the place and the file.
Result<Sha256> add_image_file(const SceneFiles& files, const std::filesystem::path& path, ImageAsset image,
                              LoadedScene& loaded);

/// Reads an OBJ file of at most 4 GiB.
Result<ObjFile> read_obj_file(const SceneFiles& files, const std::filesystem::path& path);

inline constexpr std::size_t kMostNotices = 1000;
/// Adds those notices that are not there yet; beyond kMostNotices one says that there are more.
void append_notices(const std::vector<std::string>& from, std::vector<std::string>& to);

}  // namespace lightmill
