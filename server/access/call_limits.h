// How often one caller may ask something of a coordinator.
#pragma once

#include <cstdint>
#include <string>
#include <unordered_map>

#include "common/base/clock.h"
#include "common/base/status.h"
#include "server/access/allowance.h"
#include "server/access/rights.h"

namespace lightmill {

struct CallLimitOptions {
  double requests_per_second = 200;        ///< of one caller, and ten times as many at once
  std::uint32_t streams_per_caller = 256;  ///< of each kind (StreamKind)
  std::uint32_t streams = 8'192;           ///< assets under way, of all callers
};

/// Who counts as one: an identity at an address (address_key), or whoever is at it and shows nothing.
std::string caller_key(const Identity& identity, std::string_view peer);

/// Whether a call counts as a request: all but those of assets, of which one scene may have thousands, and workers'
/// streams, which have a limit of their own.
bool counts_as_request(Rpc rpc);

/// Not thread-safe.
class CallLimits {
 public:
  explicit CallLimits(const CallLimitOptions& options)
      : per_second_(options.requests_per_second), others_(allowance()) {}

  /// RESOURCE_EXHAUSTED says the limit, and when to try again.
  Status take_request(const std::string& caller, Time now);

  std::size_t callers() const { return callers_.size(); }
  /// Callers that are told apart; those beyond share what one has.
  static constexpr std::size_t kMostCallers = 20'000;

 private:
  Allowance allowance() const { return {per_second_, 10 * per_second_}; }
  /// The caller's, made if there is room.
  Allowance& allowance_of(const std::string& caller, Time now);

  const double per_second_;
  std::unordered_map<std::string, Allowance> callers_;
  Allowance others_;
  Time swept_at_{};
};

}  // namespace lightmill
