#include "common/base/text.h"
#include "common/scene_io/loaders.h"
#include "common/scene_io/mitsuba/mitsuba.h"

namespace lightmill {

Result<LoadedScene> load_mitsuba(const std::filesystem::path& path, const SceneFiles& files) {
  constexpr std::uint64_t kMaxBytes = std::uint64_t{4} << 30;
  LM_ASSIGN_OR_RETURN(std::string text, files.read(path, kMaxDocumentBytes));
  LM_ASSIGN_OR_RETURN(LoadedScene loaded,
                      read_mitsuba(std::move(text), path.string(), files_below(path.parent_path(), files, kMaxBytes)));
  loaded.scene.name = utf8_text(path.stem().string());
  return loaded;
}

}  // namespace lightmill
