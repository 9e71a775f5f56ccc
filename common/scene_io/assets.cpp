#include "common/scene_io/assets.h"

#include "common/base/file.h"

namespace lightmill {
namespace {

constexpr std::uint64_t kMaxObjBytes = std::uint64_t{4} << 30;

}  // namespace

Result<Sha256> add_mesh(const Mesh& mesh, LoadedScene& loaded) {
  LM_RETURN_IF_ERROR(validate(mesh));
  return add_bytes(encode_mesh(mesh), loaded);
}

Sha256 add_bytes(std::string bytes, LoadedScene& loaded) {
  const Sha256 digest = sha256(bytes);
  loaded.assets.try_emplace(digest, std::move(bytes));
  return digest;
}

Result<Sha256> add_file(const std::filesystem::path& path, std::uint64_t max_bytes, LoadedScene& loaded) {
  LM_ASSIGN_OR_RETURN(std::string bytes, read_file(path, max_bytes));
  return add_bytes(std::move(bytes), loaded);
}

Result<ObjFile> read_obj_file(const std::filesystem::path& path) {
  LM_ASSIGN_OR_RETURN(const std::string text, read_file(path, kMaxObjBytes));
  return read_obj(text, path.string());
}

void append_notices(const std::vector<std::string>& from, std::vector<std::string>& to) {
  for (const std::string& notice : from) {
    if (std::find(to.begin(), to.end(), notice) == to.end()) {
      to.push_back(notice);
    }
  }
}

}  // namespace lightmill
