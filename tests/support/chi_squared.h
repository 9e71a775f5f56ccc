// A chi-squared test of counts against expectations.
#pragma once

#include <cmath>
#include <cstdint>
#include <vector>

namespace lightmill::test {

/// Excess of the statistic over chance, in standard deviations of a normal distribution (Wilson and Hilferty 1931;
/// accurate to a few percent from 3 degrees of freedom). Cells that expect fewer than 5 counts are pooled. A threshold
/// of 5 raises a false alarm once in 3.5 million tests.
inline double chi_squared_z(const std::vector<double>& counts, const std::vector<double>& expected) {
  double statistic = 0, pooled_count = 0, pooled_expected = 0;
  int cells = 0;
  const auto add = [&](double count, double expect) {
    statistic += (count - expect) * (count - expect) / expect;
    ++cells;
  };
  for (std::size_t i = 0; i < counts.size(); ++i) {
    if (expected[i] >= 5) {
      add(counts[i], expected[i]);
    } else {
      pooled_count += counts[i];
      pooled_expected += expected[i];
    }
  }
  if (pooled_expected >= 5) {
    add(pooled_count, pooled_expected);
  } else if (pooled_expected < 1e-9 && pooled_count > 0) {
    return 1e9;  // samples where none may be
  }
  const double k = cells - 1;
  return (std::cbrt(statistic / k) - (1 - 2 / (9 * k))) / std::sqrt(2 / (9 * k));
}

inline constexpr double kChiSquaredThreshold = 5;

}  // namespace lightmill::test
