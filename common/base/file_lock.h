// An exclusive lock on a file, between processes.
#pragma once

#include <filesystem>
#include <string_view>

#include "common/base/status.h"

namespace lightmill {

/// Held while it lives; it falls with the process, however that ends. The file has the number of its holder's process,
/// and stays.
class FileLock {
 public:
  /// Makes the file if need be. FAILED_PRECONDITION if another holds it: `in_use`, and the number of its process;
  /// PERMISSION_DENIED or UNAVAILABLE, naming the file, if it cannot be written or its file system has no locks.
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
