// Filter for refusals in the action log: a flood leaves few entries, and a repeated refusal one entry per hour.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <unordered_map>

#include "server/access/rights.h"
#include "server/access/token_bucket.h"

namespace lightmill {

/// Subject of a call.
struct CallSubject {
  std::uint64_t job = 0;    ///< 0: none
  std::string text = {};    ///< name of a job, worker or token
  bool was_there = false;   ///< nothing was changed: the requested state existed already
  std::string change = {};  ///< Action::change
};

/// Refusals that an entry covers, besides its own.
struct SuppressedRefusals {
  std::uint64_t repeated = 0;  ///< the same refusal, since its last entry
  std::uint64_t left_out = 0;  ///< other refusals that exceeded the limit
};

/// Not thread-safe.
class RefusalLog {
 public:
  static constexpr Duration kSameRefusal = std::chrono::hours(1);
  static constexpr std::size_t kMaxRemembered = 1'000;

  /// Whether to log this refusal now. It is not logged if the same caller got one for the same reason within the hour.
  /// After 100 entries, at most ten per minute are logged, separately for known and unknown callers.
  std::optional<SuppressedRefusals> take(const Call& call, const CallSubject& about, const Status& status, Time now);
  /// The same with the limits on the number of entries, but without the check for repetitions.
  std::optional<SuppressedRefusals> take(const Identity& caller, Time now);

 private:
  struct Seen {
    Time written_at;
    std::uint64_t repeated = 0;
  };
  struct Side {
    TokenBucket bucket{10.0 / 60, 100};
    std::uint64_t left_out = 0;
    std::unordered_map<std::string, Seen> seen;
  };
  Side& side_of(const Identity& caller) { return caller.is_known() ? of_known_ : of_unknown_; }

  Side of_known_, of_unknown_;
};

}  // namespace lightmill
