// How much of results workers are to send: as much as the coordinator takes in.
#pragma once

#include "common/base/clock.h"

namespace lightmill {

/// Results that all workers together are to send, in bytes a second: at most `most`, and less as long as they wait
/// too long for their acknowledgement, whatever it is that they wait in (the network, a busy core, the store). As TCP
/// finds its rate (Chiu and Jain 1989), with the delay as its sign (as in LEDBAT, RFC 6817): while nobody waits long
/// it grows by a part, and what is found to be too much is cut to what came in.
///
/// Units that are out keep their length: after each change the pace looks away for as long as those take.
class ResultsPace {
 public:
  /// Begins with `most`.
  ResultsPace(double most, Time now);

  double bytes_per_second() const { return rate_; }
  /// A result has come that costs as much as `bytes` do.
  void came(double bytes, Time now);
  /// A worker has said how long its results wait for their acknowledgement; `unit`: how long units take that are given
  /// out now. True if the rate has changed.
  bool waited(Duration wait, Duration unit, Time now);

 private:
  double most_, rate_;
  Time begin_;  ///< of what is looked at; what comes before it is not counted
  double bytes_ = 0, wait_seconds_ = 0;
  int waits_ = 0;
};

}  // namespace lightmill
