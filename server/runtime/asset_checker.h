// Background check of assets. After one damaged asset, it compares the other assets of the same jobs with their
// digests.
#pragma once

#include <set>
#include <thread>

#include "common/base/mutex.h"
#include "server/store/asset_store.h"

namespace lightmill {

/// Owns a thread. Thread-safe. The destructor waits for the asset that is being read.
class AssetChecker {
 public:
  explicit AssetChecker(AssetStore& assets);
  ~AssetChecker();
  AssetChecker(const AssetChecker&) = delete;
  AssetChecker& operator=(const AssetChecker&) = delete;

  /// Has these assets read soon. Damaged ones are logged and deleted, so that clients send them again.
  void check(std::set<Sha256> assets);

 private:
  void run();

  AssetStore& assets_;
  Mutex mutex_;
  CondVar changed_;
  std::set<Sha256> waiting_ LM_GUARDED_BY(mutex_);
  bool stopping_ LM_GUARDED_BY(mutex_) = false;
  std::thread thread_;  ///< last: it uses the members above
};

}  // namespace lightmill
