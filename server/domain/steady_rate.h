// Steady rate: amount per second for predictions, smoothed over rounds of results.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

namespace lightmill {

/// Counts amounts in periods, and predicts from the exponential mean over the complete ones. A period is as long as the
/// first result took, or 1 s if that is longer. Workers that start together deliver in rounds, so a period has one round.
/// It counts up to its last result. The mean remembers half of the time so far, 10 s to 2 min. Times are seconds of any
/// clock that only grows, such as a job's active time.
class SteadyRate {
 public:
  /// A result with this amount, which took a thread `seconds`.
  void add(double amount, double seconds, double now_s) {
    if (!begin_s_) {
      const double took_s = std::clamp(seconds, 0.0, now_s);
      period_s_ = std::max(took_s, kLeastPeriod);
      begin_s_ = counted_to_s_ = now_s - took_s;
      period_end_s_ = now_s + period_s_ / 2;  // rounds come in the middle of periods
    }
    advance(now_s);
    open_ += amount;
    last_s_ = now_s;
  }
  /// Seconds until `amount` more has come. It counts down between results. Infinite if unknown.
  double seconds_for(double amount, double now_s) const {
    SteadyRate then = *this;
    then.advance(now_s);
    if (then.amount_ <= 0 || then.seconds_ <= 0) {
      return std::numeric_limits<double>::infinity();
    }
    const double rest_s = (amount + then.open_) * then.seconds_ / then.amount_;
    return std::max(rest_s - (now_s - then.counted_to_s_), 0.0);
  }

 private:
  static constexpr double kLeastPeriod = 1, kLeastMemory = 10, kMostMemory = 120;  // seconds

  /// Closes the periods that have ended.
  void advance(double now_s) {
    if (!begin_s_ || now_s < period_end_s_) {
      return;
    }
    const double memory_s = std::max(std::clamp((now_s - *begin_s_) / 2, kLeastMemory, kMostMemory), 4 * period_s_);
    const double kept = std::exp(-period_s_ / memory_s);
    double empty = std::floor((now_s - period_end_s_) / period_s_) + 1;  // periods without a result
    period_end_s_ += empty * period_s_;
    if (open_ > 0) {
      --empty;
      amount_ = kept * amount_ + std::exchange(open_, 0);
      seconds_ = kept * seconds_ + (last_s_ - counted_to_s_);
      counted_to_s_ = last_s_;
    }
    const double kept_then = std::pow(kept, empty);
    amount_ *= kept_then;
    seconds_ = kept_then * seconds_ + period_s_ * (1 - kept_then) / (1 - kept);
    counted_to_s_ += empty * period_s_;
  }

  std::optional<double> begin_s_;           ///< of the work on the first result
  double period_s_ = 0, period_end_s_ = 0;  ///< of the current period
  double last_s_ = 0, counted_to_s_ = 0;    ///< the last result; the end of what the means count
  double open_ = 0;                         ///< amount of the current period
  double amount_ = 0, seconds_ = 0;         ///< means over complete periods, without their common divisor
};

}  // namespace lightmill
