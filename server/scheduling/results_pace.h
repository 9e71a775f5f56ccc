// How much of results workers are to send: as much as the coordinator takes in.
#pragma once

#include <algorithm>
#include <vector>

#include "common/base/clock.h"

namespace lightmill {

/// Results that all workers together are to send, in bytes a second: at most `most`, and less as long as they wait
/// too long for their acknowledgement, whatever it is that they wait in (the network, a busy core, the store). As TCP
/// finds its rate (Chiu and Jain 1989), with the delay as its signal (as in LEDBAT, RFC 6817): while results do not
/// wait long it grows by a part, and what is found to be too much is cut to less than what came in.
///
/// Each worker has one voice, and the median of them counts: what few of them say, however often, moves nothing.
/// Units that are out keep their length: after each change the pace looks away for as long as those take, half a
/// minute at most.
class ResultsPace {
 public:
  /// Begins with `most`.
  ResultsPace(double most, Time now);

  double bytes_per_second() const { return rate_; }
  /// A unit is given out whose worker should take so long.
  void gave(Duration unit) { longest_unit_ = std::max(longest_unit_, unit); }
  /// A result has come that costs as much as `bytes` do.
  void came(double bytes, Time now);
  bool is_due(Time now) const;
  /// What workers said before is of results of another pace, or too old.
  Time heard_from(Time now) const;
  /// To be called often, while it is due. `waits`: how long the results of each worker wait that has said so since
  /// `heard_from`; its order is changed. True if the rate has changed.
  bool look(std::vector<Duration>& waits, Time now);
  /// Results have waited for another reason than that there are too many: it takes some seconds until no worker tells
  /// of it any more.
  void stood_still(Time now);

 private:
  void look_away(Time until);

  double most_, rate_;
  Time begin_;    ///< of what is looked at; what comes before it is not counted
  Time changed_;  ///< since then what comes is of this rate
  double bytes_ = 0;
  Duration longest_unit_{};  ///< since the look before
};

}  // namespace lightmill
