// How much one caller, and all of them together, may ask of a coordinator.
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
  std::uint32_t streams_per_caller = 256;  ///< assets and films under way, jobs that are watched, scalers that listen
  std::uint32_t streams = 8'192;           ///< the same of all callers
};

/// Who counts as one: an identity at an address, or whoever is at it and shows nothing.
std::string caller_key(const Identity& identity, std::string_view peer);

/// Whether a call counts as a request: all but those of assets, of which one scene may have thousands, and workers'
/// streams, which have a limit of their own.
bool counts_as_request(Rpc rpc);
/// Whether it is a stream with a place of its own.
bool counts_as_stream(Rpc rpc);

/// Not thread-safe.
class CallLimits {
 public:
  explicit CallLimits(const CallLimitOptions& options) : options_(options), others_(options) {}

  /// RESOURCE_EXHAUSTED says the limit, and when to try again.
  Status take_request(const std::string& caller, Time now);
  /// Takes a place; what it returns is to be given back. RESOURCE_EXHAUSTED.
  Result<std::string> open_stream(const std::string& caller, Time now);
  void close_stream(const std::string& place);

  std::size_t callers() const { return callers_.size(); }
  /// Callers that are told apart; those beyond share what one has.
  static constexpr std::size_t kMostCallers = 20'000;

 private:
  struct Caller {
    explicit Caller(const CallLimitOptions& options)
        : requests(options.requests_per_second, 10 * options.requests_per_second) {}
    Allowance requests;
    std::uint32_t streams = 0;
  };
  /// Its entry, made if there is room.
  std::pair<std::string, Caller*> caller_of(const std::string& caller, Time now);

  const CallLimitOptions options_;
  std::unordered_map<std::string, Caller> callers_;
  Caller others_;
  Time swept_at_{};
  std::uint32_t streams_ = 0;
};

}  // namespace lightmill
