#include "server/store/asset_folder.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstring>
#include <optional>

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

class AssetFolder final : public AssetStore {
 public:
  AssetFolder(fs::path folder, AssetLimits limits, std::uint64_t total_bytes)
      : folder_(std::move(folder)), reserve_bytes_(limits.reserve_bytes), budget_(limits, total_bytes) {}

  std::vector<Sha256> digests() const override;
  Result<std::uint64_t> size(const Sha256& digest) const override;
  Status check_room(const Sha256& digest, const std::string& user, std::uint64_t bytes) const override;
  Result<std::unique_ptr<Upload>> start_upload(const Sha256& digest, const std::string& user) override;
  Status attribute(const Sha256& digest, const std::string& user, UserLimit limit) override;
  Result<std::unique_ptr<Reader>> open_asset(const Sha256& digest) const override;
  std::uint64_t collect(const std::set<Sha256>& wanted, std::int64_t spare_age_seconds) override;
  void forget(const Reader& damaged) override;
  std::uint64_t total_bytes() const override { return budget_.used_bytes(); }

 private:
  friend class FileUpload;
  fs::path path_of(const Sha256& digest) const;
  /// RESOURCE_EXHAUSTED if this number of further bytes would leave too little space on the disk.
  Status check_space(std::uint64_t bytes) const;

  const fs::path folder_;
  const std::uint64_t reserve_bytes_;
  AssetBudget budget_;
  std::atomic<std::uint64_t> next_temporary_ = 0;
  Mutex placing_;  ///< one upload at a time is moved into place and counted
};

class FileUpload final : public AssetStore::Upload {
 public:
  FileUpload(AssetFolder& store, const Sha256& digest, std::string user, fs::path temporary, int fd)
      : store_(store), digest_(digest), user_(std::move(user)), temporary_(std::move(temporary)), fd_(fd) {}
  ~FileUpload() override;
  FileUpload(const FileUpload&) = delete;
  FileUpload& operator=(const FileUpload&) = delete;
  Status append(ByteView bytes) override;
  Status finish() override;

 private:
  AssetFolder& store_;
  const Sha256 digest_;
  const std::string user_;
  const fs::path temporary_;
  int fd_;
  std::uint64_t size_bytes_ = 0;
  Sha256Hasher hasher_;
};

class FileReader final : public AssetStore::Reader {
 public:
  FileReader(const Sha256& digest, fs::path path, int fd) : digest_(digest), path_(std::move(path)), fd_(fd) {}
  ~FileReader() override { ::close(fd_); }
  const Sha256& digest() const { return digest_; }
  /// Deletes the file, unless another one has its path now. Returns its size in bytes if it was deleted.
  std::optional<std::uint64_t> remove_file() const;
  FileReader(const FileReader&) = delete;
  FileReader& operator=(const FileReader&) = delete;
  Result<std::string> next(std::size_t limit_bytes) override;

 private:
  const Sha256 digest_;
  const fs::path path_;
  const int fd_;
};

fs::path AssetFolder::path_of(const Sha256& digest) const {
  const std::string hex = digest.hex();
  return folder_ / hex.substr(0, 2) / hex.substr(2);
}

Result<std::uint64_t> AssetFolder::size(const Sha256& digest) const {
  struct stat info {};
  if (::stat(path_of(digest).c_str(), &info) != 0) {
    return not_found("there is no asset {}", digest.hex());
  }
  return static_cast<std::uint64_t>(info.st_size);
}

// ---- writing ----

Status AssetFolder::check_space(std::uint64_t bytes) const {
  std::error_code error;
  const std::uint64_t free_bytes = reserve_bytes_ == 0 ? 0 : fs::space(folder_, error).available;
  if (reserve_bytes_ == 0 || error || free_bytes >= reserve_bytes_ + bytes) {
    return ok_status();
  }
  return resource_exhausted("the disk of {} has less than --reserve-gib {:g} left: delete ended jobs, or free space",
                            folder_.string(), static_cast<double>(reserve_bytes_) / (1 << 30));
}

Status AssetFolder::check_room(const Sha256& digest, const std::string& user, std::uint64_t bytes) const {
  LM_RETURN_IF_ERROR(budget_.check(digest, user, bytes));
  return check_space(bytes);
}

Result<std::unique_ptr<AssetStore::Upload>> AssetFolder::start_upload(const Sha256& digest, const std::string& user) {
  const fs::path temporary = folder_ / "incoming" / fmt::format("{}-{}", digest.hex(), next_temporary_++);
  const int fd = ::open(temporary.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
  if (fd < 0) {
    return errno_error("create", temporary);
  }
  return std::unique_ptr<Upload>(std::make_unique<FileUpload>(*this, digest, user, temporary, fd));
}

FileUpload::~FileUpload() {
  if (fd_ >= 0) {
    ::close(fd_);
    ::unlink(temporary_.c_str());
    store_.budget_.release(user_, size_bytes_);
  }
}

Status FileUpload::append(ByteView bytes) {
  LM_RETURN_IF_ERROR(store_.check_space(bytes.size()));
  LM_RETURN_IF_ERROR(store_.budget_.reserve(digest_, user_, size_bytes_, bytes.size()));
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

Status FileUpload::finish() {
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
  {
    // If two uploads have the same digest, the second one replaces equal bytes.
    const MutexLock lock(store_.placing_);
    const bool there_already = store_.has(digest_);
    if (::rename(temporary_.c_str(), path.c_str()) != 0) {
      return errno_error("rename to", path);
    }
    if (there_already) {
      store_.budget_.release(user_, size_bytes_);
    } else {
      store_.budget_.stored(digest_, user_, size_bytes_);
    }
  }
  sync_folder(path.parent_path());
  sync_folder(store_.folder_);
  ::close(std::exchange(fd_, -1));
  return ok_status();
}

Status AssetFolder::attribute(const Sha256& digest, const std::string& user, UserLimit limit) {
  const MutexLock lock(placing_);
  const Result<std::uint64_t> bytes = size(digest);
  return bytes.ok() ? budget_.attribute(digest, user, *bytes, limit) : bytes.status();
}

// ---- reading ----

Result<std::unique_ptr<AssetStore::Reader>> AssetFolder::open_asset(const Sha256& digest) const {
  fs::path path = path_of(digest);
  const int fd = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (fd < 0) {
    return errno == ENOENT ? not_found("there is no asset {}", digest.hex()) : errno_error("open", path);
  }
  return std::unique_ptr<Reader>(std::make_unique<FileReader>(digest, std::move(path), fd));
}

Result<std::string> FileReader::next(std::size_t limit_bytes) {
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

// ---- deleting ----

std::vector<Sha256> AssetFolder::digests() const {
  std::vector<Sha256> all;
  std::error_code error;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder_, error)) {
    const fs::path& path = entry.path();
    const Result<Sha256> digest = Sha256::from_hex(path.parent_path().filename().string() + path.filename().string());
    if (digest.ok() && entry.is_regular_file(error)) {
      all.push_back(*digest);
    }
  }
  std::ranges::sort(all);
  return all;
}

std::uint64_t AssetFolder::collect(const std::set<Sha256>& wanted, std::int64_t spare_age_seconds) {
  std::uint64_t freed_bytes = 0;
  std::error_code error;
  const auto oldest = fs::file_time_type::clock::now() - std::chrono::seconds(spare_age_seconds);
  for (const Sha256& digest : digests()) {
    const fs::path path = path_of(digest);
    if (wanted.contains(digest) || fs::last_write_time(path, error) > oldest) {
      continue;
    }
    remove_unless_kept(digest, spare_age_seconds, [&] {
      const MutexLock lock(placing_);  // an upload may have replaced the file in the meantime
      const std::uintmax_t size_bytes = fs::file_size(path, error);
      if (error || fs::last_write_time(path, error) > oldest || !fs::remove(path, error)) {
        return false;
      }
      freed_bytes += size_bytes;
      budget_.removed(digest, size_bytes);
      return true;
    });
  }
  return freed_bytes;
}

std::optional<std::uint64_t> FileReader::remove_file() const {
  struct stat read {
  }, placed{};
  const bool same = ::fstat(fd_, &read) == 0 && ::stat(path_.c_str(), &placed) == 0 && read.st_dev == placed.st_dev &&
                    read.st_ino == placed.st_ino;
  return same && ::unlink(path_.c_str()) == 0 ? std::optional(static_cast<std::uint64_t>(read.st_size)) : std::nullopt;
}

void AssetFolder::forget(const Reader& damaged) {
  const MutexLock lock(placing_);
  const auto& read = static_cast<const FileReader&>(damaged);
  if (const std::optional<std::uint64_t> bytes = read.remove_file()) {
    budget_.removed(read.digest(), *bytes);
  }
}

}  // namespace

Result<std::unique_ptr<AssetStore>> open_asset_folder(fs::path folder, AssetLimits limits) {
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
  return std::unique_ptr<AssetStore>(std::make_unique<AssetFolder>(std::move(folder), limits, total_bytes));
}

}  // namespace lightmill
