// An exclusive lock on a file, between processes.
#pragma once

#include <filesystem>
#include <string_view>

#include "common/base/status.h"

namespace lightmill {

/// Holds the lock until it is destroyed or the process ends, even by a crash. The file contains the id of the holder's
/// process. It is never deleted.
class FileLock {
 public:
  /// Creates the file if needed, and gives it to its folder's owner. FAILED_PRECONDITION if another process holds the
  /// lock: `in_use`, and the id of that process. PERMISSION_DENIED or UNAVAILABLE, with the file's name, if it cannot
  /// be written or its file system has no locks.
  static Result<FileLock> acquire(const std::filesystem::path& path, std::string_view in_use);
  FileLock() = default;  ///< holds nothing
  ~FileLock();
  FileLock(FileLock&& other) noexcept;
  FileLock& operator=(FileLock&& other) noexcept;

 private:
  explicit FileLock(int fd) : fd_(fd) {}
  int fd_ = -1;
};

}  // namespace lightmill
