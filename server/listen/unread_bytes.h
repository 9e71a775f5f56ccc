// Bytes that known callers have sent and the server has not used yet: which connections must end.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <unordered_map>
#include <vector>

#include "server/access/connection_limiter.h"

namespace lightmill {

/// gRPC keeps requests that are not complete, of any announced size, and many on one connection. Not thread-safe.
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
  };

  explicit UnreadBytes(const Limits& limits) : limits_(limits) {}

  /// The server has used a message of this size, or thrown it away.
  void taken(Id id, std::uint64_t bytes) {
    // HTTP/2 and TLS add bytes: some to each message, and less than a percent to long ones.
    taken_[id] += bytes + bytes / 50 + kOverhead;
  }
  /// Connections to end, those with most unread bytes first: each that exceeds its limit, and the largest ones of a
  /// caller or of all that exceed theirs. `known` has all connections whose callers are known.
  std::vector<Id> over(std::span<const Received> known);

  /// What a message's header and frames take at most, in bytes.
  static constexpr std::uint64_t kOverhead = 1'024;

 private:
  const Limits limits_;
  std::unordered_map<Id, std::uint64_t> taken_;
};

}  // namespace lightmill
