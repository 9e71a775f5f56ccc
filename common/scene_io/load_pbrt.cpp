#include "common/base/text.h"
#include "common/scene_io/loaders.h"
#include "common/scene_io/pbrt/pbrt.h"

namespace lightmill {

Result<LoadedScene> load_pbrt(const std::filesystem::path& path, const SceneFiles& files) {
  constexpr std::uint64_t kMaxBytes = std::uint64_t{4} << 30;
  LM_ASSIGN_OR_RETURN(std::string text, files.read(path, kMaxBytes));
  LM_ASSIGN_OR_RETURN(LoadedScene loaded,
                      read_pbrt(std::move(text), path.string(), files_below(path.parent_path(), files, kMaxBytes)));
  loaded.scene.name = utf8_text(path.stem().string());
  return loaded;
}

}  // namespace lightmill
