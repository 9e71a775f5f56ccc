// Accounting of unread request bytes of each connection, to find those that exceed a limit.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <unordered_map>
#include <vector>

#include "server/access/connection_limiter.h"

namespace lightmill {

/// Needed because gRPC buffers incomplete requests of any announced size, and many on one connection. Not thread-safe.
/// All sizes are in bytes.
class UnreadBytes {
 public:
  using Id = ConnectionLimiter::Id;
  struct Limits {
    std::uint64_t of_connection, of_caller, of_all;
  };
  /// A connection and all its bytes since it began.
  struct Received {
    Id id;
    std::string caller;
    std::uint64_t bytes;
    bool alone = false;  ///< only the limit of one connection counts, because many machines may share its caller
  };

  explicit UnreadBytes(const Limits& limits) : limits_(limits) {}

  /// The server has used a message of this size, or thrown it away. `overhead`: of headers and frames.
  void taken(Id id, std::uint64_t bytes, std::uint64_t overhead) {
    taken_[id] += bytes + bytes / kOverheadShare + overhead;
  }
  /// Connections to end, those with most unread bytes first: each that exceeds its limit, and the largest ones of a
  /// caller or of all that exceed theirs. `known` has all connections whose callers are known.
  std::vector<Id> over(std::span<const Received> known, Time now);

  /// Headers of a call after the first one, and its frames. kCreditPerSecond covers the rest.
  static constexpr std::uint64_t kCallOverhead = 256;
  static constexpr std::uint64_t kMessageOverhead = 16;  ///< of a stream
  /// HTTP/2 and TLS add less than this part of a long message.
  static constexpr std::uint64_t kOverheadShare = 128;
  /// Credit of each connection, in bytes per second: pings, heartbeats, health checks.
  static constexpr double kCreditPerSecond = 32;

 private:
  const Limits limits_;
  std::unordered_map<Id, std::uint64_t> taken_;
  Time last_{};  ///< when it was counted last
};

}  // namespace lightmill
