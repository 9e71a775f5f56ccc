// The coordinator's data folder and its exclusive lock.
#pragma once

#include <filesystem>

#include "common/base/file_lock.h"
#include "common/base/status.h"

namespace lightmill {

/// Holds the lock on a data folder. The lock ends with the process.
class DataFolder {
 public:
  /// Creates the folder if it does not exist, and locks it. FAILED_PRECONDITION if another coordinator uses it; the
  /// message names the folder and the process.
  static Result<DataFolder> open(const std::filesystem::path& path);

  const std::filesystem::path& path() const { return path_; }
  std::filesystem::path database_file() const { return database_file_of(path_); }
  static std::filesystem::path database_file_of(const std::filesystem::path& path) { return path / "lightmill.sqlite"; }
  std::filesystem::path assets_folder() const { return path_ / "assets"; }

 private:
  DataFolder(std::filesystem::path path, FileLock lock) : path_(std::move(path)), lock_(std::move(lock)) {}
  std::filesystem::path path_;
  FileLock lock_;
};

}  // namespace lightmill
