// Assets that a worker holds in memory, each fetched once and checked against its digest.
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

/// Gets the bytes of an asset from somewhere; may take long.
using AssetFetch = std::function<Result<std::string>(const Sha256&)>;

/// Least recently used first to go. Thread-safe; two threads that ask for the same missing asset may both fetch it.
class AssetCache {
 public:
  AssetCache(AssetFetch fetch, std::uint64_t limit_bytes) : fetch_(std::move(fetch)), limit_bytes_(limit_bytes) {}

  /// UNAVAILABLE if what was fetched has another digest; else the errors of the fetch.
  Result<std::string> get(const Sha256& digest);
  void clear();
  std::uint64_t bytes() const;

 private:
  struct Entry {
    Sha256 digest;
    std::string bytes;
  };
  const AssetFetch fetch_;
  const std::uint64_t limit_bytes_;
  mutable Mutex mutex_;
  std::list<Entry> entries_ LM_GUARDED_BY(mutex_);  ///< last used first
  std::unordered_map<Sha256, std::list<Entry>::iterator> index_ LM_GUARDED_BY(mutex_);
  std::uint64_t bytes_ LM_GUARDED_BY(mutex_) = 0;
};

}  // namespace lightmill
