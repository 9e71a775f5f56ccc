#include "server/store/data_folder.h"

namespace lightmill {
namespace fs = std::filesystem;

Result<DataFolder> DataFolder::open(const fs::path& path) {
  std::error_code error;
  if (fs::create_directories(path, error)) {
    fs::permissions(path, fs::perms::owner_all, error);  // the coordinator decides who reads pictures and assets
  }
  if (error) {
    return make_error(StatusCode::kPermissionDenied,
                      "cannot create the data folder {}: {}. Choose another one with --data", path.string(),
                      error.message());
  }
  const fs::perms allowed = fs::status(path, error).permissions();
  if (!error && (allowed & fs::perms::others_write) != fs::perms::none) {
    return make_error(
        StatusCode::kPermissionDenied,
        "other users of this machine can write to the data folder {}, and could replace the farm's files: "
        "run `chmod o-w {}`",
        path.string(), path.string());
  }
  LM_ASSIGN_OR_RETURN(
      FileLock lock,
      FileLock::acquire(path / "lock",
                        fmt::format("the data folder {} is in use by another lightmill-server: stop that one, or "
                                    "choose another folder with --data",
                                    path.string())));
  return DataFolder(path, std::move(lock));
}

}  // namespace lightmill
