#include "worker/assets/asset_cache.h"

namespace lightmill {

Result<std::string> AssetCache::get(const Sha256& digest) {
  {
    const MutexLock lock(mutex_);
    if (const auto at = index_.find(digest); at != index_.end()) {
      entries_.splice(entries_.begin(), entries_, at->second);
      return at->second->bytes;
    }
  }
  LM_ASSIGN_OR_RETURN(std::string bytes, fetch_(digest));
  if (const Sha256 actual = sha256(bytes); actual != digest) {
    return unavailable("asset {} is damaged: what arrived has the digest {}", digest.hex(), actual.hex());
  }
  const MutexLock lock(mutex_);
  if (bytes.size() <= limit_bytes_ && !index_.contains(digest)) {
    bytes_ += bytes.size();
    entries_.push_front({digest, bytes});
    index_[digest] = entries_.begin();
    while (bytes_ > limit_bytes_) {
      bytes_ -= entries_.back().bytes.size();
      index_.erase(entries_.back().digest);
      entries_.pop_back();
    }
  }
  return bytes;
}

void AssetCache::clear() {
  const MutexLock lock(mutex_);
  index_.clear();
  entries_.clear();
  bytes_ = 0;
}

}  // namespace lightmill
