#include "server/store/data_directory.h"

namespace lightmill {
namespace fs = std::filesystem;

Result<DataDirectory> DataDirectory::open(const fs::path& path) {
  std::error_code error;
  if (fs::create_directories(path, error)) {
    fs::permissions(path, fs::perms::owner_all, error);  // the coordinator decides who reads pictures and assets
  }
  if (error) {
    return make_error(StatusCode::kPermissionDenied, "cannot create the data directory {}: {}", path.string(),
                      error.message());
  }
  LM_ASSIGN_OR_RETURN(
      FileLock lock,
      FileLock::acquire(path / "lock",
                        fmt::format("the data directory {} is in use by another lightmill-server: stop that one, or "
                                    "choose another directory with --data",
                                    path.string())));
  return DataDirectory(path, std::move(lock));
}

}  // namespace lightmill
