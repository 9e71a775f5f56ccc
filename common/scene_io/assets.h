// Functions that add files to a loaded scene's assets.
#pragma once

#include <filesystem>

#include "common/scene/mesh.h"
#include "common/scene_io/load.h"
#include "common/scene_io/obj.h"

namespace lightmill {

/// A name in a file of another program as a name of the scene: UTF-8, and cut so that a number which makes it unique has
/// room.
std::string scene_name(std::string_view text);

/// Encodes a mesh and adds it. An error says what is wrong with the mesh.
Result<Sha256> add_mesh(const Mesh& mesh, LoadedScene& loaded);

/// Adds the bytes of a file unchanged.
Sha256 add_bytes(std::string bytes, LoadedScene& loaded);

/// Adds the bytes of an image file, and `image`, whose asset is set here.
Sha256 add_image(std::string bytes, ImageAsset image, LoadedScene& loaded);

/// Reads an image file of at most 1 GiB and adds it unchanged. An error names the place and the file.
Result<Sha256> add_image_file(const SceneFiles& files, const std::filesystem::path& path, ImageAsset image,
                              LoadedScene& loaded);

/// Adds an object whose mesh is among the assets. An error names the limit that the scene exceeds. Files may name a
/// mesh in many places, so few bytes can make many objects.
Status add_object(Object object, LoadedScene& loaded);

/// Reads an OBJ file of at most 4 GiB.
Result<ObjFile> read_obj_file(const SceneFiles& files, const std::filesystem::path& path, Faults& faults);

inline constexpr std::size_t kMaxNotices = 1000;
/// Adds the notices that are not there yet. Beyond kMaxNotices one notice says that there are more.
void append_notices(const std::vector<std::string>& from, std::vector<std::string>& to);

}  // namespace lightmill
