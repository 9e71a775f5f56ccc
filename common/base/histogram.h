// A histogram of values, for metrics.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

namespace lightmill {

class Histogram {
 public:
  /// `bounds`: upper ends of the buckets, ascending, in the values' unit. Larger values have a bucket of their own.
  explicit Histogram(std::span<const double> bounds)
      : bounds_(bounds.begin(), bounds.end()), counts_(bounds.size() + 1) {}

  void add(double value) {
    ++counts_[static_cast<std::size_t>(std::ranges::lower_bound(bounds_, value) - bounds_.begin())];
    sum_ += value;
  }
  const std::vector<double>& bounds() const { return bounds_; }
  const std::vector<std::uint64_t>& counts() const { return counts_; }  ///< per bucket, not cumulative
  double sum() const { return sum_; }

 private:
  std::vector<double> bounds_;
  std::vector<std::uint64_t> counts_;
  double sum_ = 0;
};

}  // namespace lightmill
