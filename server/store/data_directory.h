// The directory that holds all of a coordinator's state, and its exclusive lock.
#pragma once

#include <filesystem>

#include "common/base/file_lock.h"
#include "common/base/status.h"

namespace lightmill {

/// Holds the lock on a data directory while it lives; the lock falls with the process, however that ends.
class DataDirectory {
 public:
  /// Creates the directory if need be and locks it. FAILED_PRECONDITION, naming the directory and the other process, if
  /// another coordinator uses it.
  static Result<DataDirectory> open(const std::filesystem::path& path);

  const std::filesystem::path& path() const { return path_; }
  std::filesystem::path database_file() const { return database_file_of(path_); }
  static std::filesystem::path database_file_of(const std::filesystem::path& path) { return path / "lightmill.sqlite"; }
  std::filesystem::path assets_folder() const { return path_ / "assets"; }

 private:
  DataDirectory(std::filesystem::path path, FileLock lock) : path_(std::move(path)), lock_(std::move(lock)) {}
  std::filesystem::path path_;
  FileLock lock_;
};

}  // namespace lightmill
