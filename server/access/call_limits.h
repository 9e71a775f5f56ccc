// Rate limits of a caller's calls to the coordinator.
#pragma once

#include <cstdint>
#include <string>
#include <unordered_map>

#include "common/base/clock.h"
#include "common/base/status.h"
#include "server/access/rights.h"
#include "server/access/token_bucket.h"

namespace lightmill {

struct CallLimitOptions {
  double requests_per_second = 200;        ///< of one caller; bursts may have ten times as many
  std::uint32_t streams_per_caller = 256;  ///< of each StreamKind
  std::uint32_t streams = 8'192;           ///< asset streams of all callers
};

/// The key under which a caller is counted: an identity at an address (address_key), or the address alone without an
/// identity.
std::string caller_key(const Identity& identity, std::string_view peer);

/// Whether a call counts as a request. Calls for assets do not, because a scene can have thousands. Workers' streams do
/// not, because they have their own limit.
bool counts_as_request(const Rpc& rpc);

/// Not thread-safe.
class CallLimits {
 public:
  explicit CallLimits(const CallLimitOptions& options) : per_second_(options.requests_per_second), others_(bucket()) {}

  /// RESOURCE_EXHAUSTED with the limit and the time to wait.
  Status take_request(const std::string& caller, Time now);

  /// Charges the caller for the list entries that its last request returned. Many entries cost further requests.
  void charge_entries(const std::string& caller, std::size_t entries, Time now);

  std::size_t callers() const { return callers_.size(); }
  /// Callers with their own bucket. The others share one.
  static constexpr std::size_t kMaxCallers = 20'000;
  static constexpr std::size_t kEntriesOfARequest = 50;

 private:
  TokenBucket bucket() const { return {per_second_, 10 * per_second_}; }
  /// The caller's bucket, created if there is room. Otherwise the shared one.
  TokenBucket& bucket_of(const std::string& caller, Time now);

  const double per_second_;
  std::unordered_map<std::string, TokenBucket> callers_;
  TokenBucket others_;
  Time swept_at_{};
};

}  // namespace lightmill
