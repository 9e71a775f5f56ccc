#include "server/store/asset_store.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "common/base/log.h"

namespace lightmill {
namespace fs = std::filesystem;
namespace {

Status errno_error(std::string_view what, const fs::path& path) {
  const int code = errno;
  return make_error(code == ENOSPC || code == EDQUOT ? StatusCode::kResourceExhausted : StatusCode::kUnavailable,
                    "cannot {} {}: {}", what, path.string(), std::strerror(code));
}

void sync_folder(const fs::path& folder) {
  const int fd = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (fd >= 0) {
    ::fsync(fd);
    ::close(fd);
  }
}

}  // namespace

Result<std::unique_ptr<AssetStore>> AssetStore::open(fs::path folder, AssetLimits limits) {
  std::error_code error;
  fs::create_directories(folder / "incoming", error);
  if (error) {
    return make_error(StatusCode::kPermissionDenied, "cannot create {}: {}", folder.string(), error.message());
  }
  std::uint64_t total_bytes = 0;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder, error)) {
    if (!entry.is_regular_file(error)) {
      continue;
    }
    if (entry.path().parent_path().filename() == "incoming") {
      fs::remove(entry.path(), error);
    } else {
      total_bytes += entry.file_size(error);
    }
  }
  return std::unique_ptr<AssetStore>(new AssetStore(std::move(folder), limits, total_bytes));
}

fs::path AssetStore::path_of(const Sha256& digest) const {
  const std::string hex = digest.hex();
  return folder_ / hex.substr(0, 2) / hex.substr(2);
}

bool AssetStore::has(const Sha256& digest) const {
  return size(digest).ok();
}

Result<std::uint64_t> AssetStore::size(const Sha256& digest) const {
  struct stat info {};
  if (::stat(path_of(digest).c_str(), &info) != 0) {
    return not_found("there is no asset {}", digest.hex());
  }
  return static_cast<std::uint64_t>(info.st_size);
}

Status AssetStore::reserve(std::uint64_t bytes) {
  const MutexLock lock(mutex_);
  if (total_bytes_ + bytes > limits_.total_bytes) {
    return resource_exhausted(
        "the farm's assets would pass their limit of {} bytes; raise --max-assets-gib or delete jobs",
        limits_.total_bytes);
  }
  total_bytes_ += bytes;
  return ok_status();
}

void AssetStore::release(std::uint64_t bytes) {
  const MutexLock lock(mutex_);
  total_bytes_ -= bytes;
}

std::uint64_t AssetStore::total_bytes() const {
  const MutexLock lock(mutex_);
  return total_bytes_;
}

// ---- writing ----

Result<std::unique_ptr<AssetStore::Upload>> AssetStore::start_upload(const Sha256& digest) {
  std::uint64_t number = 0;
  {
    const MutexLock lock(mutex_);
    number = next_temporary_++;
  }
  const fs::path temporary = folder_ / "incoming" / fmt::format("{}-{}", digest.hex(), number);
  const int fd = ::open(temporary.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
  if (fd < 0) {
    return errno_error("create", temporary);
  }
  return std::unique_ptr<Upload>(new Upload(*this, digest, temporary, fd));
}

AssetStore::Upload::Upload(AssetStore& store, const Sha256& digest, fs::path temporary, int fd)
    : store_(store), digest_(digest), temporary_(std::move(temporary)), fd_(fd) {}

AssetStore::Upload::~Upload() {
  if (fd_ >= 0) {
    ::close(fd_);
    ::unlink(temporary_.c_str());
    store_.release(size_bytes_);
  }
}

Status AssetStore::Upload::append(ByteView bytes) {
  if (size_bytes_ + bytes.size() > store_.limits_.asset_bytes) {
    return resource_exhausted("asset {} is larger than the limit of {} bytes", digest_.hex(),
                              store_.limits_.asset_bytes);
  }
  LM_RETURN_IF_ERROR(store_.reserve(bytes.size()));
  size_bytes_ += bytes.size();
  hasher_.append(bytes);
  while (!bytes.empty()) {
    const ssize_t written = ::write(fd_, bytes.data(), bytes.size());
    if (written < 0) {
      if (errno == EINTR) {
        continue;
      }
      return errno_error("write", temporary_);
    }
    bytes = bytes.subspan(static_cast<std::size_t>(written));
  }
  return ok_status();
}

Status AssetStore::Upload::finish() {
  if (const Sha256 actual = hasher_.finish(); actual != digest_) {
    return invalid_argument("the {} bytes sent as asset {} have the digest {}", size_bytes_, digest_.hex(),
                            actual.hex());
  }
  if (::fsync(fd_) != 0) {
    return errno_error("flush", temporary_);
  }
  const fs::path path = store_.path_of(digest_);
  std::error_code error;
  fs::create_directories(path.parent_path(), error);
  // Whoever comes second finds the same bytes in place.
  const bool there_already = store_.has(digest_);
  if (::rename(temporary_.c_str(), path.c_str()) != 0) {
    return errno_error("rename to", path);
  }
  sync_folder(path.parent_path());
  sync_folder(store_.folder_);
  ::close(std::exchange(fd_, -1));
  if (there_already) {
    store_.release(size_bytes_);
  }
  return ok_status();
}

// ---- reading ----

Result<std::unique_ptr<AssetStore::Reader>> AssetStore::open_asset(const Sha256& digest) const {
  fs::path path = path_of(digest);
  const int fd = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (fd < 0) {
    return errno == ENOENT ? not_found("there is no asset {}", digest.hex()) : errno_error("open", path);
  }
  return std::unique_ptr<Reader>(new Reader(std::move(path), fd));
}

AssetStore::Reader::~Reader() {
  ::close(fd_);
}

Result<std::string> AssetStore::Reader::next(std::size_t limit_bytes) {
  std::string bytes(limit_bytes, '\0');
  for (;;) {
    const ssize_t got = ::read(fd_, bytes.data(), bytes.size());
    if (got >= 0) {
      bytes.resize(static_cast<std::size_t>(got));
      return bytes;
    }
    if (errno != EINTR) {
      return errno_error("read", path_);
    }
  }
}

// ---- forgetting ----

std::uint64_t AssetStore::collect(const std::set<Sha256>& wanted, std::int64_t spare_age_seconds) {
  std::uint64_t freed_bytes = 0;
  std::error_code error;
  const auto oldest = fs::file_time_type::clock::now() - std::chrono::seconds(spare_age_seconds);
  std::vector<fs::path> unwanted;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder_, error)) {
    const fs::path& path = entry.path();
    if (!entry.is_regular_file(error) || entry.last_write_time(error) > oldest) {
      continue;
    }
    const Result<Sha256> digest = Sha256::from_hex(path.parent_path().filename().string() + path.filename().string());
    if (digest.ok() && !wanted.contains(*digest)) {
      unwanted.push_back(path);
    }
  }
  for (const fs::path& path : unwanted) {
    const std::uintmax_t size_bytes = fs::file_size(path, error);
    if (!error && fs::remove(path, error)) {
      freed_bytes += size_bytes;
    }
  }
  release(freed_bytes);
  return freed_bytes;
}

}  // namespace lightmill
