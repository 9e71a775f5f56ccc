// In-memory cache of assets. Each is fetched once, and checked against its digest.
#pragma once

#include <cstdint>
#include <functional>
#include <list>
#include <string>
#include <unordered_map>

#include "common/base/digest.h"
#include "common/base/mutex.h"
#include "common/base/status.h"

namespace lightmill {

/// Fetches the bytes of an asset. May take long.
using AssetFetch = std::function<Result<std::string>(const Sha256&)>;

/// Drops the least recently used asset first. Thread-safe. Two threads that need the same missing asset may both fetch
/// it.
class AssetCache {
 public:
  AssetCache(AssetFetch fetch, std::uint64_t limit_bytes) : fetch_(std::move(fetch)), limit_bytes_(limit_bytes) {}

  /// UNAVAILABLE if the fetched bytes have another digest. Otherwise the errors of the fetch.
  Result<std::string> get(const Sha256& digest);
  void clear();

 private:
  struct Entry {
    Sha256 digest;
    std::string bytes;
  };
  const AssetFetch fetch_;
  const std::uint64_t limit_bytes_;
  Mutex mutex_;
  std::list<Entry> entries_ LM_GUARDED_BY(mutex_);  ///< most recently used first
  std::unordered_map<Sha256, std::list<Entry>::iterator> index_ LM_GUARDED_BY(mutex_);
  std::uint64_t bytes_ LM_GUARDED_BY(mutex_) = 0;
};

}  // namespace lightmill
