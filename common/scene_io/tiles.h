// Textures of several images, one for each square of u and v (UDIM).
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <string_view>

#include "common/scene_io/load.h"
#include "common/scene_io/scene_files.h"

namespace lightmill {

/// Stands for the tile's number in the name of a file.
inline constexpr std::string_view kTileToken = "<UDIM>";
/// Whether the last part of a path has the token. Folders cannot have it.
inline bool names_tiles(std::string_view path) {
  const std::size_t slash = path.find_last_of("/\\");
  return path.substr(slash == std::string_view::npos ? 0 : slash + 1).find(kTileToken) != std::string_view::npos;
}

/// The path with a number instead of the last token.
std::string with_tile_number(std::string path, int number);

/// The files of a path whose last part has the token, by their number.
std::map<int, std::filesystem::path> find_tiles(const SceneFiles& files, const std::filesystem::path& path);

/// Reads all files of such a path. The texture gets the first one, and further textures the others. `image`: as for
/// add_image_file; its name is that of the texture's file. Fails if there are none.
Status add_tiles(const SceneFiles& files, const std::filesystem::path& path, std::uint32_t texture,
                 const ImageAsset& image, LoadedScene& loaded);

}  // namespace lightmill
