#include "common/base/file_lock.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <utility>

#include "common/base/file.h"

namespace lightmill {

Result<FileLock> FileLock::acquire(const std::filesystem::path& path, std::string_view in_use) {
  FileLock lock(::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644));
  if (lock.fd_ < 0) {
    return make_error(StatusCode::kPermissionDenied, "cannot write {}: {}", path.string(), std::strerror(errno));
  }
  give_to_owner_of_folder(lock.fd_, path);
  if (::flock(lock.fd_, LOCK_EX | LOCK_NB) != 0) {
    if (errno != EWOULDBLOCK) {
      return make_error(StatusCode::kUnavailable, "cannot lock {}: {}", path.string(), std::strerror(errno));
    }
    std::array<char, 32> holder{};
    const ssize_t got = ::pread(lock.fd_, holder.data(), holder.size() - 1, 0);
    return failed_precondition("{} (process {})", in_use,
                               got > 0 ? std::string(holder.data(), static_cast<std::size_t>(got)) : "unknown");
  }
  const std::string pid = std::to_string(::getpid());
  if (::ftruncate(lock.fd_, 0) != 0 || ::pwrite(lock.fd_, pid.data(), pid.size(), 0) < 0) {
    return make_error(StatusCode::kUnavailable, "cannot write {}: {}", path.string(), std::strerror(errno));
  }
  return lock;
}

FileLock::FileLock(FileLock&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}

FileLock& FileLock::operator=(FileLock&& other) noexcept {
  std::swap(fd_, other.fd_);
  return *this;
}

FileLock::~FileLock() {
  if (fd_ >= 0) {
    ::close(fd_);
  }
}

}  // namespace lightmill
