#include "common/scene_io/tiles.h"

#include <charconv>

#include "common/base/check.h"
#include "common/base/text.h"
#include "common/scene_io/assets.h"

namespace lightmill {

std::string with_tile_number(std::string path, int number) {
  const std::size_t token = path.rfind(kTileToken);
  LM_CHECK(token != std::string::npos, "{} has no {}", path, kTileToken);
  return path.replace(token, kTileToken.size(), fmt::format("{}", number));
}

std::map<int, std::filesystem::path> find_tiles(const SceneFiles& files, const std::filesystem::path& path) {
  std::map<int, std::filesystem::path> found;
  const std::string name = path.filename().string();
  const std::size_t token = name.rfind(kTileToken);
  if (token == std::string::npos) {
    return found;
  }
  const std::string_view before = std::string_view(name).substr(0, token);
  const std::string_view after = std::string_view(name).substr(token + kTileToken.size());
  for (const std::string& entry : files.names(path.parent_path())) {
    constexpr std::size_t kDigits = 4;
    if (entry.size() == before.size() + kDigits + after.size() && entry.starts_with(before) && entry.ends_with(after)) {
      int number = 0;
      const char* const end = entry.data() + before.size() + kDigits;
      if (std::from_chars(entry.data() + before.size(), end, number).ptr == end && number >= kFirstTile &&
          number <= kLastTile) {
        found.emplace(number, path.parent_path() / entry);
      }
    }
  }
  return found;
}

Status add_tiles(const SceneFiles& files, const std::filesystem::path& path, std::uint32_t texture,
                 const ImageAsset& image, LoadedScene& loaded) {
  const std::map<int, std::filesystem::path> tiles = find_tiles(files, path);
  const TextureImage whole = loaded.scene.textures[texture];
  if (tiles.empty()) {
    return not_found("{}: there is no tile, such as {}", image.place,
                     utf8_text(with_tile_number(whole.file, kFirstTile)));
  }
  bool first = true;
  for (const auto& [number, file] : tiles) {
    const std::string name = with_tile_number(whole.file, number);
    LM_ASSIGN_OR_RETURN(const Sha256 asset, add_image_file(files, file, {.name = name, .place = image.place}, loaded));
    TextureImage tile = whole;
    tile.file = name;
    tile.asset = asset;
    tile.tile = number;
    if (first) {
      loaded.scene.textures[texture] = tile;
    } else {
      tile.name = fmt::format("{} <{}>", whole.name, number);
      tile.tile_of = texture;
      loaded.scene.textures.push_back(tile);
    }
    first = false;
  }
  return ok_status();
}

}  // namespace lightmill
