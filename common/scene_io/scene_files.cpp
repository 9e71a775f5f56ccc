#include "common/scene_io/scene_files.h"

#include "common/base/file.h"
#include "common/base/text.h"

namespace lightmill {
namespace fs = std::filesystem;
namespace {

class FilesOnDisk final : public SceneFiles {
 public:
  Result<std::string> read(const fs::path& path, std::uint64_t limit_bytes) const override {
    std::error_code error;
    if (const fs::file_status what = fs::status(path, error); fs::exists(what) && !fs::is_regular_file(what)) {
      return invalid_argument("cannot read {}: it is not a regular file",
                              path.string());  // a pipe or a device has no end
    }
    return read_file(path, limit_bytes);
  }
  bool exists(const fs::path& path) const override {
    std::error_code error;
    return fs::exists(path, error);
  }
  bool is_file(const fs::path& path) const override {
    std::error_code error;
    return fs::is_regular_file(path, error);
  }
  std::set<std::string> names(const fs::path& folder) const override {
    std::set<std::string> out;
    std::error_code error;
    for (fs::directory_iterator entry(folder.empty() ? "." : folder, error), end; !error && entry != end;
         entry.increment(error)) {
      out.insert(entry->path().filename().string());
    }
    return out;
  }
};

/// "a/../b//c" and "b/c" are one name. Does not look at the disk.
std::string normal_form(const fs::path& path) {
  return path.lexically_normal().generic_string();
}

}  // namespace

const SceneFiles& files_on_disk() {
  static const FilesOnDisk files;
  return files;
}

Status UploadedFiles::add(const std::string& path, const Sha256& digest) {
  const std::string name = normal_form(path);
  if (path.empty() || path.size() > kMaxPathBytes || path.find('\0') != std::string::npos ||
      fs::path(path).is_absolute() || name == "." || name.ends_with('/') || name == ".." || name.starts_with("../")) {
    return invalid_argument(
        "the path '{}' of a file must be relative, have 1 to {} bytes, and not lead above its folder",
        printable(path.substr(0, 200)), kMaxPathBytes);
  }
  if (!files_.try_emplace(name, digest).second) {
    return invalid_argument("two files have the path '{}'", printable(name));
  }
  return ok_status();
}

bool UploadedFiles::is_file(const fs::path& path) const {
  return files_.contains(normal_form(path));
}

std::set<std::string> UploadedFiles::names(const fs::path& folder) const {
  const std::string within = folder.empty() ? "." : normal_form(folder / "");
  const std::string prefix = within == "." || within == "./" ? "" : within;
  std::set<std::string> out;
  for (auto file = files_.lower_bound(prefix); file != files_.end() && file->first.starts_with(prefix); ++file) {
    out.insert(file->first.substr(prefix.size(), file->first.find('/', prefix.size()) - prefix.size()));
  }
  return out;
}

Result<std::string> UploadedFiles::read(const fs::path& path, std::uint64_t limit_bytes) const {
  const auto found = files_.find(normal_form(path));
  if (found == files_.end()) {
    return not_found(
        "{}: is not among the uploaded files: add it with the path that the scene uses, relative to the other files",
        path.string());
  }
  LM_ASSIGN_OR_RETURN(std::string bytes, with_context(fetch_(found->second), path.string()));
  if (bytes.size() > limit_bytes) {
    return invalid_argument("{}: has {} bytes, more than {}", path.string(), bytes.size(), limit_bytes);
  }
  return bytes;
}

}  // namespace lightmill
