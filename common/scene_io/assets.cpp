#include "common/scene_io/assets.h"

#include <algorithm>

#include "common/base/number_text.h"
#include "common/base/text.h"
#include "common/wire/limits.h"

namespace lightmill {
namespace {

constexpr std::uint64_t kMaxObjBytes = std::uint64_t{4} << 30;
constexpr std::uint64_t kMaxImageBytes = std::uint64_t{1} << 30;
constexpr std::uint64_t kMaxNamesBytes = std::uint64_t{64} << 20;  ///< more than a packed scene can have

}  // namespace

std::string scene_name(std::string_view text) {
  constexpr std::size_t kRoom = 20;
  return cut_text(utf8_text(text), kMaxSceneNameBytes - kRoom);
}

Result<Sha256> add_mesh(const Mesh& mesh, LoadedScene& loaded) {
  LM_RETURN_IF_ERROR(validate(mesh));
  return add_bytes(encode_mesh(mesh), loaded);
}

Sha256 add_bytes(std::string bytes, LoadedScene& loaded) {
  const Sha256 digest = sha256(bytes);
  loaded.assets.try_emplace(digest, std::move(bytes));
  return digest;
}

Sha256 add_image(std::string bytes, ImageAsset image, LoadedScene& loaded) {
  image.asset = add_bytes(std::move(bytes), loaded);
  return loaded.images.emplace_back(std::move(image)).asset;
}

Result<Sha256> add_image_file(const SceneFiles& files, const std::filesystem::path& path, ImageAsset image,
                              LoadedScene& loaded) {
  LM_ASSIGN_OR_RETURN(std::string bytes, with_context(files.read(path, kMaxImageBytes), image.place));
  return add_image(std::move(bytes), std::move(image), loaded);
}

Status add_object(Object object, LoadedScene& loaded) {
  const auto* mesh = std::get_if<MeshShape>(&object.shape);
  loaded.name_bytes += object.name.size() + (mesh == nullptr ? 0 : mesh->file.size());
  if (loaded.scene.objects.size() == kMaxSceneEntries) {
    return invalid_argument("the scene has more than {} objects", kMaxSceneEntries);
  }
  if (loaded.assets.size() > kMaxAssets) {
    return invalid_argument("the scene has more than {} different meshes and images", kMaxAssets);
  }
  if (loaded.name_bytes > kMaxNamesBytes) {
    return invalid_argument("the names of the scene's objects have more than {}", human_bytes(kMaxNamesBytes));
  }
  loaded.scene.objects.push_back(std::move(object));
  return ok_status();
}

Result<ObjFile> read_obj_file(const SceneFiles& files, const std::filesystem::path& path, Faults& faults) {
  LM_ASSIGN_OR_RETURN(const std::string text, files.read(path, kMaxObjBytes));
  return read_obj(text, path.string(), faults);
}

void append_notices(const std::vector<std::string>& from, std::vector<std::string>& to) {
  for (const std::string& notice : from) {
    if (to.size() > kMaxNotices) {
      return;
    }
    if (std::find(to.begin(), to.end(), notice) == to.end()) {
      to.push_back(to.size() < kMaxNotices ? notice : "more notices on these files are left out");
    }
  }
}

}  // namespace lightmill
