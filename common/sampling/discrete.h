// Discrete distributions, sampled by their cumulative probabilities.
#pragma once

#include <numeric>
#include <span>
#include <vector>

#include "common/math/simd.h"

namespace lightmill {

/// The sum in double precision, from first to last.
inline double sum_of(std::span<const double> values) {
  return std::accumulate(values.begin(), values.end(), 0.0);
}

/// Appends the weights.size() + 1 cumulative probabilities of weights, from 0 to 1. Returns the sum of the weights.
/// Probabilities are rounded to multiples of 2^-24, as random numbers are, so their differences are exactly the
/// probabilities of sampling. If the sum is zero, the first has all probability.
double append_cumulative(std::span<const double> weights, std::vector<float>& out);

/// A discrete distribution, sampled by inverting its cumulative sums. This keeps the stratification of the random
/// numbers.
class DiscreteDistribution {
 public:
  DiscreteDistribution() = default;
  /// Weights must be non-negative with a positive sum. Weights below about 2^-25 of the sum may get probability zero.
  explicit DiscreteDistribution(std::span<const double> weights);

  std::size_t size() const { return pmf_.size(); }
  float pmf(std::size_t i) const { return pmf_[i]; }

  struct Choice8 {
    U8 index;
    F8 pmf;
  };
  /// For u in [0, 1). Entries of probability zero are never chosen.
  Choice8 sample(F8 u) const;

 private:
  std::vector<float> pmf_;
  std::vector<float> first_;  ///< first_[i] is the sum of pmf below i; size() + 1 entries, the last at least 1
  int steps_ = 0;             ///< of the binary search
};

}  // namespace lightmill
