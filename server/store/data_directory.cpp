#include "server/store/data_directory.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

namespace lightmill {
namespace fs = std::filesystem;

Result<DataDirectory> DataDirectory::open(const fs::path& path) {
  std::error_code error;
  if (fs::create_directories(path, error)) {
    fs::permissions(path, fs::perms::owner_all, error);  // pictures and assets are for whom the coordinator lets in
  }
  if (error) {
    return make_error(StatusCode::kPermissionDenied, "cannot create the data directory {}: {}", path.string(),
                      error.message());
  }
  const fs::path lock = path / "lock";
  const int fd = ::open(lock.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644);
  if (fd < 0) {
    return make_error(StatusCode::kPermissionDenied, "cannot write in the data directory {}: {}", path.string(),
                      std::strerror(errno));
  }
  if (::flock(fd, LOCK_EX | LOCK_NB) != 0) {
    std::array<char, 32> holder{};
    const ssize_t got = ::pread(fd, holder.data(), holder.size() - 1, 0);
    ::close(fd);
    return failed_precondition(
        "the data directory {} is in use by another lightmill-server (process {}): stop that one, or choose another "
        "directory with --data",
        path.string(), got > 0 ? std::string(holder.data(), static_cast<std::size_t>(got)) : "unknown");
  }
  const std::string pid = std::to_string(::getpid());
  if (::ftruncate(fd, 0) != 0 || ::pwrite(fd, pid.data(), pid.size(), 0) < 0) {
    Status failed = make_error(StatusCode::kUnavailable, "cannot write {}: {}", lock.string(), std::strerror(errno));
    ::close(fd);
    return failed;
  }
  return DataDirectory(path, fd);
}

DataDirectory::DataDirectory(DataDirectory&& other) noexcept
    : path_(std::move(other.path_)), lock_fd_(std::exchange(other.lock_fd_, -1)) {}

DataDirectory::~DataDirectory() {
  if (lock_fd_ >= 0) {
    ::close(lock_fd_);
  }
}

}  // namespace lightmill
