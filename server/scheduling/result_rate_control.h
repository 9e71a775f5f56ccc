// Rate control of results: the bytes per second that workers may send, so that the coordinator can take them.
#pragma once

#include <algorithm>
#include <vector>

#include "common/base/clock.h"

namespace lightmill {

/// The median of at least one wait. Changes their order.
Duration median_of(std::vector<Duration>& waits);

/// Limit on the results of all workers together, in bytes per second: `most`, or less while results wait too long for
/// their acknowledgement, whatever the cause. Control as in TCP (Chiu and Jain 1989), with the delay as signal (as in
/// LEDBAT, RFC 6817). The rate grows by a factor while waits are short, and is cut below the rate of arrivals when they
/// are long. Each identity counts once, and the median decides, so a few machines cannot move the rate. After a change
/// nothing is measured until the units leased before it are done, for at most 30 s.
class ResultRateControl {
 public:
  /// Begins with `most`.
  ResultRateControl(double most, Time now);

  double bytes_per_second() const { return rate_; }
  /// A unit was leased that should take this time.
  void add_unit(Duration unit) { longest_unit_ = std::max(longest_unit_, unit); }
  /// A result came whose cost equals that of `bytes` bytes.
  void add_result(double bytes, Time now);
  bool is_due(Time now) const;
  /// Reports of waits from before this time belong to another rate, or are too old.
  Time window_start(Time now) const;
  /// Call it often, while it is due. `waits`: the wait of each identity whose workers reported some since `window_start`.
  /// It changes their order. True if the rate has changed.
  bool update(std::vector<Duration>& waits, Time now);
  /// Results waited for another reason than their number. Workers report such waits for some seconds more.
  void note_stall(Time now);

 private:
  void ignore_until(Time until);

  double most_, rate_;
  Time begin_;    ///< start of the measurement; earlier results do not count
  Time changed_;  ///< results are at this rate since then
  double bytes_ = 0;
  Duration longest_unit_{};  ///< since the last measurement
};

}  // namespace lightmill
