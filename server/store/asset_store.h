// Assets on disk, named by their content: assets/ab/cdef….
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "common/base/digest.h"
#include "common/base/mutex.h"
#include "common/base/status.h"

namespace lightmill {

struct AssetLimits {
  std::uint64_t asset_bytes = std::uint64_t{2} << 30;   ///< of one asset
  std::uint64_t total_bytes = std::uint64_t{64} << 30;  ///< of all together
};

/// A folder of immutable blobs. Thread-safe. An asset is there wholly, with the bytes of its digest, or not at all.
class AssetStore {
 public:
  /// Creates the folder if need be, and removes what interrupted uploads left.
  static Result<std::unique_ptr<AssetStore>> open(std::filesystem::path folder, AssetLimits limits);

  bool has(const Sha256& digest) const;
  /// Size in bytes; NOT_FOUND.
  Result<std::uint64_t> size(const Sha256& digest) const;

  /// An upload under way. Not thread-safe; one that is not finished leaves nothing.
  class Upload {
   public:
    ~Upload();
    Upload(const Upload&) = delete;
    Upload& operator=(const Upload&) = delete;
    /// RESOURCE_EXHAUSTED over a limit or on a full disk.
    Status append(ByteView bytes);
    /// Verifies the digest (INVALID_ARGUMENT) and puts the asset in place, durably.
    Status finish();

   private:
    friend class AssetStore;
    Upload(AssetStore& store, const Sha256& digest, std::filesystem::path temporary, int fd);
    AssetStore& store_;
    Sha256 digest_;
    std::filesystem::path temporary_;
    int fd_ = -1;
    std::uint64_t size_bytes_ = 0;
    Sha256Hasher hasher_;
  };
  Result<std::unique_ptr<Upload>> start_upload(const Sha256& digest);

  /// Reads an asset piece by piece.
  class Reader {
   public:
    ~Reader();
    Reader(const Reader&) = delete;
    Reader& operator=(const Reader&) = delete;
    /// The next at most `limit_bytes`; empty at the end.
    Result<std::string> next(std::size_t limit_bytes);

   private:
    friend class AssetStore;
    Reader(std::filesystem::path path, int fd) : path_(std::move(path)), fd_(fd) {}
    std::filesystem::path path_;
    int fd_;
  };
  Result<std::unique_ptr<Reader>> open_asset(const Sha256& digest) const;

  /// Forgets assets that are not in `wanted` and were not touched for `spare_age_seconds`. Returns the bytes freed.
  std::uint64_t collect(const std::set<Sha256>& wanted, std::int64_t spare_age_seconds);
  std::uint64_t total_bytes() const;

 private:
  AssetStore(std::filesystem::path folder, AssetLimits limits, std::uint64_t total_bytes)
      : folder_(std::move(folder)), limits_(limits), total_bytes_(total_bytes) {}
  std::filesystem::path path_of(const Sha256& digest) const;
  Status reserve(std::uint64_t bytes);
  void release(std::uint64_t bytes);

  const std::filesystem::path folder_;
  const AssetLimits limits_;
  mutable Mutex mutex_;
  std::uint64_t total_bytes_ LM_GUARDED_BY(mutex_) = 0;  ///< of assets in place and of uploads under way
  std::uint64_t next_temporary_ LM_GUARDED_BY(mutex_) = 0;
};

}  // namespace lightmill
