#include "common/sampling/filter_table.h"

#include <algorithm>

#include "common/base/check.h"

namespace lightmill {

FilterTable::FilterTable(double radius, const std::function<double(double)>& density) {
  // The cumulative distribution of the right half, by a fine midpoint rule. The left half is its mirror image.
  constexpr int kSteps = 1 << 14;
  std::vector<double> cumulative(kSteps + 1, 0.0);
  for (int i = 0; i < kSteps; ++i) {
    const double x = radius * (i + 0.5) / kSteps;
    cumulative[i + 1] = cumulative[i] + density(x);
  }
  const double total = cumulative[kSteps];
  LM_CHECK(total > 0, "a pixel filter must not be zero everywhere");

  inverse_.resize(kCells + 1);
  int step = 0;
  for (int i = 0; i <= kCells / 2; ++i) {
    const double target = total * i / (kCells / 2);
    while (step < kSteps - 1 && cumulative[step + 1] < target) {
      ++step;
    }
    const double width = cumulative[step + 1] - cumulative[step];
    const double within = width > 0 ? std::clamp((target - cumulative[step]) / width, 0.0, 1.0) : 0.0;
    const double x = i == 0 ? 0.0 : radius * (step + within) / kSteps;
    inverse_[kCells / 2 + i] = static_cast<float>(x);
    inverse_[kCells / 2 - i] = static_cast<float>(-x);
  }
}

float FilterTable::density(float x) const {
  const auto above = std::upper_bound(inverse_.begin(), inverse_.end(), x);
  if (above == inverse_.begin() || above == inverse_.end()) {
    return 0;
  }
  return 1 / (static_cast<float>(kCells) * (*above - *(above - 1)));
}

}  // namespace lightmill
