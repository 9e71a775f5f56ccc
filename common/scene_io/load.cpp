#include "common/scene_io/load.h"

#include "common/base/file.h"
#include "common/scene_io/loaders.h"
#include "common/wire/scene_json.h"

namespace lightmill {
namespace fs = std::filesystem;
namespace {

Result<fs::path> resolve(const fs::path& path) {
  std::error_code error;
  const fs::path with_ending = path.string() + ".json";
  if (path.extension() != ".json" && !fs::is_regular_file(path, error) && fs::is_regular_file(with_ending, error)) {
    return with_ending;
  }
  if (!fs::exists(path, error)) {
    return not_found("{}: no such file", path.string());
  }
  if (path.extension() != ".json" && path.extension() != ".obj") {
    return invalid_argument("{}: a scene document (.json) or Wavefront files (.obj) are expected", path.string());
  }
  return path;
}

}  // namespace

Result<LoadedScene> load_scene(std::span<const fs::path> paths, const LoadOptions& options) {
  if (paths.empty()) {
    return invalid_argument("a scene document (.json) or Wavefront files (.obj) are expected, got none");
  }
  std::vector<fs::path> files;
  bool any_document = false;
  for (const fs::path& path : paths) {
    LM_ASSIGN_OR_RETURN(fs::path file, resolve(path));
    any_document = any_document || file.extension() == ".json";
    files.push_back(std::move(file));
  }
  if (any_document && files.size() > 1) {
    return invalid_argument("one scene document or any number of .obj files are expected, got {} files with a document",
                            files.size());
  }
  LM_ASSIGN_OR_RETURN(LoadedScene loaded, any_document ? load_document(files[0]) : load_objs(files, options.ka));
  if (options.camera_file) {
    LM_ASSIGN_OR_RETURN(const std::string text, read_file(*options.camera_file, kMaxDocumentBytes));
    LM_ASSIGN_OR_RETURN(loaded.scene.camera, read_camera_json(text, options.camera_file->string()));
  }
  LM_RETURN_IF_ERROR(validate(loaded.scene));
  return loaded;
}

}  // namespace lightmill
