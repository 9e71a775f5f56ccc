#include "common/sampling/discrete.h"

#include <bit>
#include <cmath>

#include "common/base/check.h"

namespace lightmill {

double append_cumulative(std::span<const double> weights, std::vector<float>& out) {
  double total = 0;
  for (const double w : weights) {
    LM_CHECK(w >= 0);
    total += w;
  }
  double sum = 0;
  for (const double w : weights) {
    out.push_back(total > 0 ? static_cast<float>(std::nearbyint(sum / total * 0x1p24) * 0x1p-24) : sum == 0 ? 0 : 1);
    sum += total > 0 ? w : 1;
  }
  out.push_back(1.0f);
  return total;
}

DiscreteDistribution::DiscreteDistribution(std::span<const double> weights) {
  LM_CHECK(append_cumulative(weights, first_) > 0);
  for (std::size_t i = 0; i < weights.size(); ++i) {
    pmf_.push_back(first_[i + 1] - first_[i]);
  }
  steps_ = static_cast<int>(std::bit_width(weights.size() - 1));
}

DiscreteDistribution::Choice8 DiscreteDistribution::sample(F8 u) const {
  // The largest i with first_[i] <= u. Entries of probability zero have the value of the next one, so they are not
  // chosen.
  const M8 all(true);
  U8 low(0u);
  U8 high(static_cast<std::uint32_t>(size() - 1));
  for (int step = 0; step < steps_; ++step) {
    const U8 middle = (low + high + U8(1u)) >> 1;
    const M8 right = gather(first_.data(), middle, all) <= u;
    low = select(right, middle, low);
    high = select(right, high, middle - U8(1u));
  }
  const F8 pmf = gather(pmf_.data(), low, all);
  return {low, pmf};
}

}  // namespace lightmill
