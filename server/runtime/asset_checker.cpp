#include "server/runtime/asset_checker.h"

#include "common/base/log.h"
#include "server/store/check_state.h"

namespace lightmill {

AssetChecker::AssetChecker(AssetStore& assets) : assets_(assets), thread_([this] { run(); }) {}

AssetChecker::~AssetChecker() {
  {
    const MutexLock lock(mutex_);
    stopping_ = true;
    changed_.notify_all();
  }
  thread_.join();
}

void AssetChecker::check(std::set<Sha256> assets) {
  const MutexLock lock(mutex_);
  waiting_.merge(assets);
  changed_.notify_all();
}

void AssetChecker::run() {
  for (;;) {
    Sha256 digest;
    {
      const MutexLock lock(mutex_);
      while (!stopping_ && waiting_.empty()) {
        changed_.wait(mutex_);
      }
      if (stopping_) {
        return;
      }
      digest = waiting_.extract(waiting_.begin()).value();
    }
    const Status status = check_asset(assets_, digest).status();
    if (!status.ok() && status.code() != StatusCode::kDataLoss && status.code() != StatusCode::kNotFound) {
      spdlog::error("asset {} cannot be compared with its digest: {}", digest.hex(), message_of(status));
    }
  }
}

}  // namespace lightmill
