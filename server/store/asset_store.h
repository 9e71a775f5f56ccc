// Interface of asset stores: immutable blobs, named by the SHA-256 of their bytes.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "common/base/digest.h"
#include "common/base/mutex.h"
#include "common/base/status.h"

namespace lightmill {

struct AssetLimits {
  std::uint64_t asset_bytes = std::uint64_t{2} << 30;   ///< per asset
  std::uint64_t total_bytes = std::uint64_t{64} << 30;  ///< all assets together
  std::uint64_t user_bytes = total_bytes;               ///< those of one user
  std::uint64_t reserve_bytes = 0;                      ///< free space that uploads leave on the disk of a folder
};

/// Bytes that each asset counts for its user in addition. Small files take a block of the disk and an inode.
inline constexpr std::uint64_t kBytesOfFile = 4096;
/// The user that the uploads of all workers count for. Together they may have half as much as a user.
inline constexpr std::string_view kUploadsOfWorkers = "(workers)";

/// Treatment of an asset that exceeds its user's limit, by AssetStore::attribute().
enum class UserLimit {
  enforced,
  ignored,  ///< the asset was accepted before
};

/// Thread-safe. An asset is complete and its bytes match its digest, or it does not exist.
class AssetStore {
 public:
  virtual ~AssetStore() = default;

  bool has(const Sha256& digest) const { return size(digest).ok(); }
  /// Like has(). The caller is about to name the asset in a job, so collect() spares it as if it were new.
  bool keep(const Sha256& digest) const;
  /// Digests of all stored assets.
  virtual std::vector<Sha256> digests() const = 0;
  /// Size in bytes; NOT_FOUND.
  virtual Result<std::uint64_t> size(const Sha256& digest) const = 0;

  /// OK if the user can upload an asset of `bytes` bytes now. RESOURCE_EXHAUSTED names the limit.
  virtual Status check_room(const Sha256& digest, const std::string& user, std::uint64_t bytes) const = 0;
  /// An upload in progress. Not thread-safe. An unfinished upload leaves nothing.
  class Upload {
   public:
    virtual ~Upload() = default;
    /// RESOURCE_EXHAUSTED if a limit is exceeded or the disk is full.
    virtual Status append(ByteView bytes) = 0;
    /// Checks the digest (INVALID_ARGUMENT) and stores the asset durably.
    virtual Status finish() = 0;
  };
  /// The asset counts as the user's until it is deleted, unless it was there before. Empty: as no user's.
  virtual Result<std::unique_ptr<Upload>> start_upload(const Sha256& digest, const std::string& user = "") = 0;
  /// From now on, a stored asset counts as the user's, unless it counts as another user's. One that a worker sent
  /// changes from kUploadsOfWorkers to the user. RESOURCE_EXHAUSTED if `limit` is enforced and the user has no room for
  /// it.
  virtual Status attribute(const Sha256& digest, const std::string& user, UserLimit limit) = 0;

  /// Reads an asset piece by piece. Not thread-safe.
  class Reader {
   public:
    virtual ~Reader() = default;
    /// Returns the next 1 to `limit_bytes` bytes, or an empty string at the end.
    virtual Result<std::string> next(std::size_t limit_bytes) = 0;
  };
  virtual Result<std::unique_ptr<Reader>> open_asset(const Sha256& digest) const = 0;

  /// Deletes assets that are not in `wanted`, if they were stored and last kept more than `spare_age_seconds` ago.
  /// Returns the bytes freed.
  virtual std::uint64_t collect(const std::set<Sha256>& wanted, std::int64_t spare_age_seconds) = 0;
  /// Deletes an asset that one of its readers found to be damaged, so that clients send it again. A newer copy stays.
  virtual void forget(const Reader& damaged) = 0;
  /// Bytes of stored assets and of uploads in progress.
  virtual std::uint64_t total_bytes() const = 0;

 protected:
  /// Calls `remove` unless the asset was kept less than `spare_age_seconds` ago. Calls of keep() wait until it returns.
  bool remove_unless_kept(const Sha256& digest, std::int64_t spare_age_seconds, const std::function<bool()>& remove);

 private:
  using Moment = std::chrono::steady_clock::time_point;
  mutable Mutex keeping_;
  mutable std::map<Sha256, Moment> kept_ LM_GUARDED_BY(keeping_);
};

/// Counts the bytes of all assets and of each user, and enforces the limits. Thread-safe.
class AssetBudget {
 public:
  AssetBudget(AssetLimits limits, std::uint64_t used_bytes) : limits_(limits), used_bytes_(used_bytes) {}

  /// Reserves `more_bytes` for an asset that has `had_bytes`. RESOURCE_EXHAUSTED, without a reservation, if a limit is
  /// exceeded.
  Status reserve(const Sha256& digest, const std::string& user, std::uint64_t had_bytes, std::uint64_t more_bytes);
  /// Like reserve(), without a reservation.
  Status check(const Sha256& digest, const std::string& user, std::uint64_t bytes) const;
  /// An upload ended, and left nothing.
  void release(const std::string& user, std::uint64_t bytes);
  /// An upload ended, and its asset is new.
  void stored(const Sha256& digest, const std::string& user, std::uint64_t bytes);
  /// A stored asset is deleted.
  void removed(const Sha256& digest, std::uint64_t bytes);
  Status attribute(const Sha256& digest, const std::string& user, std::uint64_t bytes, UserLimit limit);
  std::uint64_t used_bytes() const;

 private:
  Status check(const Sha256& digest, const std::string& user, std::uint64_t had_bytes, std::uint64_t more_bytes) const
      LM_REQUIRES(mutex_);
  Status check_user(const std::string& user, std::uint64_t more_bytes) const LM_REQUIRES(mutex_);
  void take_back(const std::string& user, std::uint64_t bytes) LM_REQUIRES(mutex_);

  const AssetLimits limits_;
  mutable Mutex mutex_;
  std::uint64_t used_bytes_ LM_GUARDED_BY(mutex_);
  std::map<std::string, std::uint64_t> bytes_of_ LM_GUARDED_BY(mutex_);  ///< by user
  struct Counted {
    std::string user;
    std::uint64_t bytes = 0;
  };
  std::map<Sha256, Counted> user_of_ LM_GUARDED_BY(mutex_);  ///< stored assets that count for a user
};

}  // namespace lightmill
