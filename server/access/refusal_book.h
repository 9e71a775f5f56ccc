// Which refusals are worth a line in the farm's log: a flood leaves a few, and what is refused again and again one an
// hour.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <unordered_map>

#include "server/access/allowance.h"
#include "server/access/rights.h"

namespace lightmill {

/// What a call was about.
struct About {
  std::uint64_t job = 0;   ///< 0: none
  std::string text = {};   ///< a worker, or a token
  bool was_there = false;  ///< nothing was changed: what was asked for had been done before
};

/// What a line stands for besides its own refusal.
struct Unwritten {
  std::uint64_t repeated = 0;  ///< the same, since it was written last
  std::uint64_t left_out = 0;  ///< others, of which there were too many
};

/// Not thread-safe.
class RefusalBook {
 public:
  static constexpr Duration kSameRefusal = std::chrono::hours(1);
  static constexpr std::size_t kMostRemembered = 1'000;

  /// Whether this refusal is to be written down now: not if it was within the hour, to the same caller for the same
  /// reason; nor more than ten a minute once a hundred were, of callers who are known and of those who are not.
  std::optional<Unwritten> take(const Call& call, const About& about, const Status& status, Time now);
  /// The same by number alone.
  std::optional<Unwritten> take(const Identity& caller, Time now);

 private:
  struct Seen {
    Time written_at;
    std::uint64_t repeated = 0;
  };
  struct Side {
    Allowance allowance{10.0 / 60, 100};
    std::uint64_t left_out = 0;
    std::unordered_map<std::string, Seen> seen;
  };
  Side& side_of(const Identity& caller) { return caller.is_known() ? of_known_ : of_unknown_; }

  Side of_known_, of_unknown_;
};

}  // namespace lightmill
