// Rate meter: amount per second in the last few seconds.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "common/base/clock.h"

namespace lightmill {

/// Counts into bins, by default of half a second, and averages over the last ten.
class RateMeter {
 public:
  explicit RateMeter(Duration bin = std::chrono::milliseconds(500)) : bin_(bin) {}
  void add(double amount, Time now) {
    const std::int64_t bin = bin_of(now);
    if (first_bin_ < 0) {
      first_ = now;
      first_bin_ = bin;
    }
    Bin& slot = bins_[static_cast<std::size_t>(bin) % kBins];
    if (slot.number != bin) {
      slot = {bin, 0};
    }
    slot.amount += amount;
  }
  /// Per second; over the time since the first amount if that is shorter.
  double per_second(Time now) const {
    if (first_bin_ < 0) {
      return 0;
    }
    const Time window_start{bin_ * std::max<std::int64_t>(bin_of(now) - kBins + 1, 0)};
    return recent(now) / std::max(to_seconds(now - std::max(window_start, first_)), 0.1);
  }
  /// Sum of the amounts in the last ten bins.
  double recent(Time now) const {
    const std::int64_t bin = bin_of(now);
    double sum = 0;
    for (const Bin& slot : bins_) {
      sum += slot.number > bin - kBins ? slot.amount : 0;
    }
    return sum;
  }

 private:
  static constexpr std::int64_t kBins = 10;
  std::int64_t bin_of(Time now) const { return now.time_since_epoch() / bin_; }

  struct Bin {
    std::int64_t number = -1;
    double amount = 0;
  };
  Duration bin_;
  std::array<Bin, kBins> bins_;
  std::int64_t first_bin_ = -1;
  Time first_;
};

}  // namespace lightmill
