#include "common/base/file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "common/base/descriptor.h"

namespace lightmill {
namespace fs = std::filesystem;
namespace {

Status errno_error(std::string_view what, const fs::path& path) {
  const int code = errno;
  const StatusCode status = code == ENOENT ? StatusCode::kNotFound
                            : code == ENOSPC || code == EDQUOT
                                ? StatusCode::kAborted  // RESOURCE_EXHAUSTED means a limit of the farm
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

enum class Existing { replaced, kept };

/// Gives the temporary file its final name.
Status give_name(const fs::path& temporary, const fs::path& path, Existing existing) {
  if (existing == Existing::replaced) {
    return ::rename(temporary.c_str(), path.c_str()) == 0 ? ok_status() : errno_error("cannot write", path);
  }
  if (::link(temporary.c_str(), path.c_str()) != 0) {
    return errno == EEXIST ? already_exists("{} exists already", path.string()) : errno_error("cannot write", path);
  }
  ::unlink(temporary.c_str());
  return ok_status();
}

Status write_temporary(const fs::path& temporary, const fs::path& path, ByteView bytes, mode_t mode) {
  ::unlink(temporary.c_str());  // left by an earlier process with the same number
  const Descriptor fd(::open(temporary.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, mode));
  if (fd.number() < 0) {
    return errno_error("cannot write", path);
  }
  LM_RETURN_IF_ERROR(write_all(fd.number(), bytes, path));
  return ::fsync(fd.number()) == 0 ? ok_status() : errno_error("cannot write", path);
}

Status write_and_name(const fs::path& path, ByteView bytes, mode_t mode, Existing existing) {
  const fs::path temporary = temporary_beside(path);
  Status status = write_temporary(temporary, path, bytes, mode);
  if (status.ok()) {
    status = give_name(temporary, path, existing);
  }
  if (!status.ok()) {
    ::unlink(temporary.c_str());
    return status;
  }
  return sync_folder_of(path);
}

}  // namespace

Result<std::string> read_file(const fs::path& path, std::uint64_t limit_bytes) {
  const Descriptor fd(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  if (fd.number() < 0) {
    return errno_error("cannot open", path);
  }
  struct stat info {};
  if (::fstat(fd.number(), &info) != 0) {
    return errno_error("cannot read", path);
  }
  if (S_ISDIR(info.st_mode)) {
    return invalid_argument("cannot read {}: it is a folder", path.string());
  }
  std::string bytes;
  std::array<char, 1 << 16> buffer;
  for (;;) {
    const ssize_t got = ::read(fd.number(), buffer.data(), buffer.size());
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
  if (fd.number() < 0) {
    return errno_error("cannot write", path);
  }
  ::unlink(temporary.c_str());
  return ok_status();
}

Status write_file_atomically(const fs::path& path, ByteView bytes) {
  return write_and_name(path, bytes, 0644, Existing::replaced);
}

Status write_secret_file(const fs::path& path, ByteView bytes, bool replace) {
  return write_and_name(path, bytes, 0600, replace ? Existing::replaced : Existing::kept);
}

Status sync_file(const fs::path& path) {
  const Descriptor fd(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  return fd.number() >= 0 && ::fsync(fd.number()) == 0 ? ok_status() : errno_error("cannot flush", path);
}

Status sync_folder_of(const fs::path& path) {
  const fs::path folder = path.has_parent_path() ? path.parent_path() : fs::path(".");
  const Descriptor directory(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (directory.number() >= 0 && ::fsync(directory.number()) == 0) {
    return ok_status();
  }
  const bool impossible = errno == EACCES || errno == EINVAL || errno == ENOTSUP;
  return impossible ? ok_status() : errno_error("cannot flush the folder", folder);
}

std::filesystem::path own_folder() {
  std::error_code error;
  return std::filesystem::read_symlink("/proc/self/exe", error).parent_path();
}

void give_to_owner_of_folder(int file, const fs::path& path) {
  struct stat own {
  }, folder{};
  if (::fstat(file, &own) == 0 && own.st_uid == 0 && ::stat(path.parent_path().c_str(), &folder) == 0) {
    [[maybe_unused]] const int failed = ::fchown(file, folder.st_uid, folder.st_gid);
  }
}

}  // namespace lightmill
