#include "server/access/call_limits.h"

#include <cmath>

#include "server/access/slot_pool.h"

namespace lightmill {
namespace {

/// Removal of full buckets takes about a millisecond, so it runs at most this often.
constexpr Duration kSweepPause = std::chrono::seconds(1);

}  // namespace

std::string caller_key(const Identity& identity, std::string_view peer) {
  const Holder holder = holder_of(identity, peer);
  return fmt::format("{} {}", holder.name, holder.address);
}

bool counts_as_request(const Rpc& rpc) {
  return rpc != kUploadAsset && rpc != kDownloadAsset && rpc != kWork;
}

TokenBucket& CallLimits::bucket_of(const std::string& caller, Time now) {
  if (const auto found = callers_.find(caller); found != callers_.end()) {
    return found->second;
  }
  if (callers_.size() >= kMaxCallers && now - swept_at_ >= kSweepPause) {
    swept_at_ = now;
    std::erase_if(callers_, [now](const auto& entry) { return entry.second.is_full(now); });
  }
  return callers_.size() < kMaxCallers ? callers_.emplace(caller, bucket()).first->second : others_;
}

Status CallLimits::take_request(const std::string& caller, Time now) {
  TokenBucket& requests = bucket_of(caller, now);
  return requests.take(now)
             ? ok_status()
             : resource_exhausted(
                   "the farm accepts {:g} requests per second from one caller (--caller-requests): try again in "
                   "{:.0f} ms",
                   per_second_, std::ceil(1000 * to_seconds(requests.wait(now))));
}

void CallLimits::charge_entries(const std::string& caller, std::size_t entries, Time now) {
  bucket_of(caller, now).charge(static_cast<double>(entries / kEntriesOfARequest), now);
}

}  // namespace lightmill
