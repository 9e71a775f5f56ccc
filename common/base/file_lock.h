// An exclusive lock on a file, between processes.
#pragma once

#include <filesystem>
#include <string_view>

#include "common/base/status.h"

namespace lightmill {

/// Holds the lock until it is destroyed or the process ends, in whatever way. The file contains the number of the
/// holder's process. It is never deleted.
class FileLock {
 public:
  /// Creates the file if needed. It belongs to its folder's owner, also if root creates it. FAILED_PRECONDITION if another process holds the lock: `in_use`, and the number of
  /// that process. PERMISSION_DENIED or UNAVAILABLE, with the file's name, if it cannot be written or its file system
  /// has no locks.
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
