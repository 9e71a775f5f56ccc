#include "server/store/asset_store.h"

namespace lightmill {

bool AssetStore::keep(const Sha256& digest) const {
  // The mark comes first: collect() does not remove an asset with a mark. The look-up may wait for a disk or a
  // database, so it holds no lock.
  const Moment now = std::chrono::steady_clock::now();
  {
    const MutexLock lock(keeping_);
    kept_[digest] = now;
  }
  if (has(digest)) {
    return true;
  }
  const MutexLock lock(keeping_);
  if (const auto kept = kept_.find(digest); kept != kept_.end() && kept->second == now) {
    kept_.erase(kept);
  }
  return false;
}

bool AssetStore::remove_unless_kept(const Sha256& digest, std::int64_t spare_age_seconds,
                                    const std::function<bool()>& remove) {
  const MutexLock lock(keeping_);
  if (const auto kept = kept_.find(digest); kept != kept_.end()) {
    if (std::chrono::steady_clock::now() - kept->second < std::chrono::seconds(spare_age_seconds)) {
      return false;
    }
    kept_.erase(kept);
  }
  return remove();
}

Status AssetBudget::check(const Sha256& digest, const std::string& user, std::uint64_t had_bytes,
                          std::uint64_t more_bytes) const {
  if (had_bytes + more_bytes > limits_.asset_bytes) {
    return resource_exhausted("asset {} is larger than the limit of {} bytes", digest.hex(), limits_.asset_bytes);
  }
  if (used_bytes_ + more_bytes > limits_.total_bytes) {
    return resource_exhausted(
        "the farm's assets would exceed their limit of {} bytes. Raise --max-assets-gib or delete jobs",
        limits_.total_bytes);
  }
  return check_user(user, more_bytes);
}

Status AssetBudget::check_user(const std::string& user, std::uint64_t more_bytes) const {
  const auto of_user = bytes_of_.find(user);
  const std::uint64_t limit = user == kUploadsOfWorkers ? limits_.user_bytes / 2 : limits_.user_bytes;
  if (!user.empty() && (of_user == bytes_of_.end() ? 0 : of_user->second) + more_bytes > limit) {
    return resource_exhausted(
        "the assets of '{}' would exceed their limit of {} bytes (--user-disk-gib, --max-assets-gib): delete jobs that "
        "use them. Assets that no job uses are deleted after a day",
        user, limit);
  }
  return ok_status();
}

Status AssetBudget::check(const Sha256& digest, const std::string& user, std::uint64_t bytes) const {
  const MutexLock lock(mutex_);
  return check(digest, user, 0, bytes);
}

Status AssetBudget::reserve(const Sha256& digest, const std::string& user, std::uint64_t had_bytes,
                            std::uint64_t more_bytes) {
  const MutexLock lock(mutex_);
  LM_RETURN_IF_ERROR(check(digest, user, had_bytes, more_bytes));
  used_bytes_ += more_bytes;
  if (!user.empty()) {
    bytes_of_[user] += more_bytes;
  }
  return ok_status();
}

void AssetBudget::take_back(const std::string& user, std::uint64_t bytes) {
  if (const auto of_user = bytes_of_.find(user); of_user != bytes_of_.end() && (of_user->second -= bytes) == 0) {
    bytes_of_.erase(of_user);
  }
}

void AssetBudget::release(const std::string& user, std::uint64_t bytes) {
  const MutexLock lock(mutex_);
  used_bytes_ -= bytes;
  take_back(user, bytes);
}

void AssetBudget::stored(const Sha256& digest, const std::string& user, std::uint64_t bytes) {
  const MutexLock lock(mutex_);
  if (!user.empty()) {
    user_of_[digest] = {user, bytes + kBytesOfFile};
    bytes_of_[user] += kBytesOfFile;
  }
}

void AssetBudget::removed(const Sha256& digest, std::uint64_t bytes) {
  const MutexLock lock(mutex_);
  used_bytes_ -= bytes;
  if (const auto counted = user_of_.extract(digest)) {  // a damaged file may have another size than was counted
    take_back(counted.mapped().user, counted.mapped().bytes);
  }
}

Status AssetBudget::attribute(const Sha256& digest, const std::string& user, std::uint64_t bytes, UserLimit limit) {
  const MutexLock lock(mutex_);
  const auto counted = user_of_.find(digest);
  const bool has_user = counted != user_of_.end() && counted->second.user != kUploadsOfWorkers;
  if (user.empty() || user == kUploadsOfWorkers || has_user) {
    return ok_status();
  }
  const Counted now{user, bytes + kBytesOfFile};
  if (limit == UserLimit::enforced) {
    LM_RETURN_IF_ERROR(check_user(user, now.bytes));
  }
  if (counted != user_of_.end()) {
    take_back(counted->second.user, counted->second.bytes);
  }
  user_of_[digest] = now;
  bytes_of_[user] += now.bytes;
  return ok_status();
}

std::uint64_t AssetBudget::used_bytes() const {
  const MutexLock lock(mutex_);
  return used_bytes_;
}

}  // namespace lightmill
