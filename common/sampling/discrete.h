// Choosing one of several by probability.
#pragma once

#include <numeric>
#include <span>
#include <vector>

#include "common/math/simd.h"

namespace lightmill {

/// In double precision, from first to last.
inline double sum_of(std::span<const double> values) {
  return std::accumulate(values.begin(), values.end(), 0.0);
}

/// Appends the cumulative probabilities of weights, from 0 to 1 (weights.size() + 1 of them), and gives the weights'
/// sum. They are rounded to multiples of 2^-24, the numbers that samples are drawn with: so their differences are
/// exactly the probabilities that drawing has. All probability goes to the first where the sum is zero.
double append_cumulative(std::span<const double> weights, std::vector<float>& out);

/// A discrete distribution sampled by inverting its cumulative sums, which keeps the stratification of its input.
class DiscreteDistribution {
 public:
  DiscreteDistribution() = default;
  /// Weights are non-negative with a positive sum; what is below some 2^-25 of it may get probability zero.
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
