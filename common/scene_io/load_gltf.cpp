#include "common/scene_io/file_finder.h"
#include "common/scene_io/gltf/gltf.h"
#include "common/scene_io/loaders.h"
#include "common/scene_io/text_lines.h"

namespace lightmill {

Result<LoadedScene> load_gltf(const std::filesystem::path& path, bool light_the_dark, const SceneFiles& files) {
  constexpr std::uint64_t kMaxBytes = std::uint64_t{4} << 30;
  LM_ASSIGN_OR_RETURN(std::string bytes, files.read(path, kMaxBytes));
  LM_ASSIGN_OR_RETURN(LoadedScene loaded, read_gltf(std::move(bytes), path.string(), light_the_dark,
                                                    files_below(path.parent_path(), files, kMaxBytes)));
  loaded.scene.name = utf8_name(path.stem().string());
  return loaded;
}

}  // namespace lightmill
