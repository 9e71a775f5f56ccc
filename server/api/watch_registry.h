// Owner of all watchers' streams until gRPC is done with them. Ends them when the server stops.
#pragma once

#include <map>
#include <memory>
#include <vector>

#include "common/base/mutex.h"
#include "common/base/status.h"

namespace lightmill {

/// The registry's interface to a stream.
class ClosableWatch {
 public:
  virtual ~ClosableWatch() = default;
  /// Ends the stream with UNAVAILABLE. Thread-safe.
  virtual void close() = 0;
};

/// Thread-safe.
class WatchRegistry {
 public:
  /// Owns the stream until remove(), even if it returns an error: UNAVAILABLE after stop().
  Status add(const void* key, std::shared_ptr<ClosableWatch> watch) {
    const MutexLock lock(mutex_);
    watches_.emplace(key, std::move(watch));
    return stopped_ ? unavailable("the coordinator stops") : ok_status();
  }
  void remove(const void* key) {
    std::shared_ptr<ClosableWatch> watch;  // destroyed after the lock is released
    const MutexLock lock(mutex_);
    if (const auto at = watches_.find(key); at != watches_.end()) {
      watch = std::move(at->second);
      watches_.erase(at);
    }
  }
  void stop() {
    std::vector<std::shared_ptr<ClosableWatch>> all;
    {
      const MutexLock lock(mutex_);
      stopped_ = true;
      for (const auto& [key, watch] : watches_) {
        all.push_back(watch);
      }
    }
    for (const std::shared_ptr<ClosableWatch>& watch : all) {
      watch->close();
    }
  }

 private:
  Mutex mutex_;
  std::map<const void*, std::shared_ptr<ClosableWatch>> watches_ LM_GUARDED_BY(mutex_);
  bool stopped_ LM_GUARDED_BY(mutex_) = false;
};

}  // namespace lightmill
