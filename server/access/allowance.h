// How often something may happen: so many times at once, and steadily so many a second.
#pragma once

#include <algorithm>

#include "common/base/clock.h"

namespace lightmill {

/// A bucket that is full at first, from which each time takes one, and which fills again. Not thread-safe.
class Allowance {
 public:
  /// Both positive.
  Allowance(double per_second, double at_once) : per_second_(per_second), at_once_(at_once), left_(at_once) {}

  /// Whether it may happen now; then that is one time less.
  bool take(Time now) {
    left_ = left(now);
    if (now > filled_at_) {  // times may come a little out of order: those of several threads
      filled_at_ = now;
    }
    if (left_ < 1) {
      return false;
    }
    left_ -= 1;
    return true;
  }
  /// How long it is until it may happen, nothing being taken until then.
  Duration wait(Time now) const {
    const double there = left(now);
    return there >= 1 ? Duration::zero() : from_seconds((1 - there) / per_second_);
  }
  /// Nothing was taken for so long that it is as at first.
  bool is_full(Time now) const { return left(now) >= at_once_; }

 private:
  double left(Time now) const {
    return now <= filled_at_ ? left_ : std::min(at_once_, left_ + per_second_ * to_seconds(now - filled_at_));
  }

  double per_second_, at_once_, left_;
  Time filled_at_{};
};

}  // namespace lightmill
