// Where assets lie: immutable blobs, named by their content.
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
  std::uint64_t asset_bytes = std::uint64_t{2} << 30;   ///< of one asset
  std::uint64_t total_bytes = std::uint64_t{64} << 30;  ///< of all together
};

/// Thread-safe. An asset is there wholly, with the bytes of its digest, or not at all.
class AssetStore {
 public:
  virtual ~AssetStore() = default;

  bool has(const Sha256& digest) const { return size(digest).ok(); }
  /// As has; whoever asks is about to name it, so collect spares it as if it had just come.
  bool keep(const Sha256& digest) const;
  /// Of all assets in place.
  virtual std::vector<Sha256> digests() const = 0;
  /// Size in bytes; NOT_FOUND.
  virtual Result<std::uint64_t> size(const Sha256& digest) const = 0;

  /// Whether an asset of so many bytes can be uploaded now. RESOURCE_EXHAUSTED names the limit.
  virtual Status check_room(const Sha256& digest, std::uint64_t bytes) const = 0;
  /// An upload under way. Not thread-safe; one that is not finished leaves nothing.
  class Upload {
   public:
    virtual ~Upload() = default;
    /// RESOURCE_EXHAUSTED over a limit or on a full disk.
    virtual Status append(ByteView bytes) = 0;
    /// Verifies the digest (INVALID_ARGUMENT) and puts the asset in place, durably.
    virtual Status finish() = 0;
  };
  virtual Result<std::unique_ptr<Upload>> start_upload(const Sha256& digest) = 0;

  /// Reads an asset piece by piece. Not thread-safe.
  class Reader {
   public:
    virtual ~Reader() = default;
    /// The next at most `limit_bytes`, which may be fewer; empty at the end.
    virtual Result<std::string> next(std::size_t limit_bytes) = 0;
  };
  virtual Result<std::unique_ptr<Reader>> open_asset(const Sha256& digest) const = 0;

  /// Forgets assets that are not in `wanted`, and that came and were kept more than `spare_age_seconds` ago. Returns
  /// the bytes freed.
  virtual std::uint64_t collect(const std::set<Sha256>& wanted, std::int64_t spare_age_seconds) = 0;
  /// Forgets what one of its readers has found to be damaged, so that whoever needs the asset sends it again. One that
  /// has come since stays.
  virtual void forget(const Reader& damaged) = 0;
  /// Of assets in place and of uploads under way.
  virtual std::uint64_t total_bytes() const = 0;

 protected:
  /// Removes an asset unless it was kept less than so many seconds ago; who wants to keep it meanwhile waits.
  bool remove_unless_kept(const Sha256& digest, std::int64_t spare_age_seconds, const std::function<bool()>& remove);

 private:
  using Moment = std::chrono::steady_clock::time_point;
  mutable Mutex keeping_;
  mutable std::map<Sha256, Moment> kept_ LM_GUARDED_BY(keeping_);
};

/// Keeps count of the bytes of all assets, and within the limits. Thread-safe.
class AssetBudget {
 public:
  AssetBudget(AssetLimits limits, std::uint64_t used_bytes) : limits_(limits), used_bytes_(used_bytes) {}

  /// Takes `more_bytes` for an asset that has `had_bytes`. RESOURCE_EXHAUSTED, and nothing taken, over a limit.
  Status reserve(const Sha256& digest, std::uint64_t had_bytes, std::uint64_t more_bytes);
  /// The same without taking them.
  Status check(const Sha256& digest, std::uint64_t bytes) const;
  void release(std::uint64_t bytes);
  std::uint64_t used_bytes() const;

 private:
  Status check(const Sha256& digest, std::uint64_t had_bytes, std::uint64_t more_bytes) const LM_REQUIRES(mutex_);

  const AssetLimits limits_;
  mutable Mutex mutex_;
  std::uint64_t used_bytes_ LM_GUARDED_BY(mutex_);
};

}  // namespace lightmill
