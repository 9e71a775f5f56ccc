#include "common/base/file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

namespace lightmill {
namespace fs = std::filesystem;
namespace {

/// Owns a file descriptor.
class Descriptor {
 public:
  explicit Descriptor(int fd) : fd_(fd) {}
  ~Descriptor() {
    if (fd_ >= 0) {
      ::close(fd_);
    }
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  int get() const { return fd_; }

 private:
  int fd_;
};

Status errno_error(std::string_view what, const fs::path& path) {
  const int code = errno;
  const StatusCode status = code == ENOENT                    ? StatusCode::kNotFound
                            : code == ENOSPC                  ? StatusCode::kResourceExhausted
                            : code == EACCES || code == EPERM ? StatusCode::kPermissionDenied
                                                              : StatusCode::kFailedPrecondition;
  return make_error(status, "{} {}: {}", what, path.string(), std::strerror(code));
}

fs::path temporary_beside(const fs::path& path) {
  return fmt::format("{}.{}.tmp", path.string(), ::getpid());
}

Status write_all(int fd, ByteView bytes, const fs::path& path) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(fd, bytes.data(), bytes.size());
    if (written < 0) {
      if (errno == EINTR) {
        continue;
      }
      return errno_error("cannot write", path);
    }
    bytes = bytes.subspan(static_cast<std::size_t>(written));
  }
  return ok_status();
}

}  // namespace

Result<std::string> read_file(const fs::path& path, std::uint64_t limit_bytes) {
  const Descriptor fd(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  if (fd.get() < 0) {
    return errno_error("cannot open", path);
  }
  struct stat info {};
  if (::fstat(fd.get(), &info) != 0) {
    return errno_error("cannot read", path);
  }
  if (S_ISDIR(info.st_mode)) {
    return invalid_argument("cannot read {}: it is a directory", path.string());
  }
  std::string bytes;
  std::array<char, 1 << 16> buffer;
  for (;;) {
    const ssize_t got = ::read(fd.get(), buffer.data(), buffer.size());
    if (got < 0) {
      if (errno == EINTR) {
        continue;
      }
      return errno_error("cannot read", path);
    }
    if (got == 0) {
      return bytes;
    }
    bytes.append(buffer.data(), static_cast<std::size_t>(got));
    if (bytes.size() > limit_bytes) {
      return resource_exhausted("cannot read {}: larger than the limit of {} bytes", path.string(), limit_bytes);
    }
  }
}

Status check_can_write(const fs::path& path) {
  const fs::path temporary = temporary_beside(path);
  const Descriptor fd(::open(temporary.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644));
  if (fd.get() < 0) {
    return errno_error("cannot write", path);
  }
  ::unlink(temporary.c_str());
  return ok_status();
}

Status write_file_atomically(const fs::path& path, ByteView bytes) {
  const fs::path temporary = temporary_beside(path);
  {
    const Descriptor fd(::open(temporary.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644));
    if (fd.get() < 0) {
      return errno_error("cannot write", path);
    }
    Status written = write_all(fd.get(), bytes, path);
    if (written.ok() && ::fsync(fd.get()) != 0) {
      written = errno_error("cannot write", path);
    }
    if (!written.ok()) {
      ::unlink(temporary.c_str());
      return written;
    }
  }
  if (::rename(temporary.c_str(), path.c_str()) != 0) {
    Status failed = errno_error("cannot write", path);
    ::unlink(temporary.c_str());
    return failed;
  }
  const fs::path folder = path.has_parent_path() ? path.parent_path() : fs::path(".");
  const Descriptor directory(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (directory.get() >= 0) {
    ::fsync(directory.get());
  }
  return ok_status();
}

}  // namespace lightmill
