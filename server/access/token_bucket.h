// Token bucket: limits the rate of something, and allows bursts.
#pragma once

#include <algorithm>

#include "common/base/clock.h"

namespace lightmill {

/// A bucket that starts full. Each use takes one token. It refills at a constant rate. Not thread-safe.
class TokenBucket {
 public:
  /// Tokens per second, and size of the bucket. Both are positive.
  TokenBucket(double per_second, double burst) : per_second_(per_second), burst_(burst), left_(burst) {}

  /// Takes a token, if there is one.
  bool take(Time now) {
    left_ = left(now);
    if (now > filled_at_) {  // times of several threads may be slightly out of order
      filled_at_ = now;
    }
    if (left_ < 1) {
      return false;
    }
    left_ -= 1;
    return true;
  }
  /// Takes tokens for a use that has already happened. The bucket may get a negative balance.
  void charge(double tokens, Time now) {
    left_ = left(now) - tokens;
    filled_at_ = std::max(filled_at_, now);
  }
  /// Time until the next token, if none is taken meanwhile.
  Duration wait(Time now) const {
    const double there = left(now);
    return there >= 1 ? Duration::zero() : from_seconds((1 - there) / per_second_);
  }
  /// Whether the bucket is full again.
  bool is_full(Time now) const { return left(now) >= burst_; }

 private:
  double left(Time now) const {
    return now <= filled_at_ ? left_ : std::min(burst_, left_ + per_second_ * to_seconds(now - filled_at_));
  }

  double per_second_, burst_, left_;
  Time filled_at_{};
};

}  // namespace lightmill
