// Measured cost: seconds of one thread for a pixel sample, from results.
#pragma once

#include <algorithm>
#include <cstdint>

namespace lightmill {

/// Mean that follows slow changes: over all of the first ten values, then over about the last ten.
class RecentMean {
 public:
  void add(double value) {
    ++count_;
    value_ += (value - value_) * std::max(1.0 / static_cast<double>(count_), 0.1);
  }
  /// The next value will be at least this.
  void expect(double value) { value_ = std::max(value_, value); }
  bool known() const { return count_ > 0 || value_ > 0; }
  double value() const { return value_; }  ///< 0 until known

 private:
  double value_ = 0;
  std::uint64_t count_ = 0;
};

/// Peak that rises at once, and falls over about a hundred values.
class RecentPeak {
 public:
  void add(double value) { value_ = value > value_ ? value : value_ + (value - value_) / 64; }
  double value() const { return value_; }  ///< 0 until known

 private:
  double value_ = 0;
};

struct MeasuredCost {
  RecentMean mean = {};
  RecentPeak peak = {};  ///< of the costlier tiles

  void add(double seconds) {
    mean.add(seconds);
    peak.add(seconds);
  }
  bool known() const { return mean.known(); }
};

}  // namespace lightmill
