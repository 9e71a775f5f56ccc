// A chi-squared test of counts against expectations.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

namespace lightmill::test {

/// Excess of the statistic over chance, in standard deviations of a normal distribution (Wilson and Hilferty 1931;
/// accurate to a few percent from 3 degrees of freedom). Cells that expect fewer than 5 counts are pooled. If the pool
/// expects fewer than 5, the smallest other cell joins it. A threshold of 5 raises a false alarm once in 3.5 million
/// tests.
inline double chi_squared_z(const std::vector<double>& counts, const std::vector<double>& expected) {
  struct Cell {
    double count = 0, expected = 0;
  };
  Cell pool;
  std::vector<Cell> cells;
  for (std::size_t i = 0; i < counts.size(); ++i) {
    if (expected[i] >= 5) {
      cells.push_back({counts[i], expected[i]});
    } else {
      pool.count += counts[i];
      pool.expected += expected[i];
    }
  }
  if (pool.expected < 1e-9 && pool.count > 0) {
    return 1e9;  // samples where the probability is 0
  }
  if (pool.expected < 5 && !cells.empty()) {
    const auto smallest = std::min_element(cells.begin(), cells.end(),
                                           [](const Cell& a, const Cell& b) { return a.expected < b.expected; });
    pool.count += smallest->count;
    pool.expected += smallest->expected;
    cells.erase(smallest);
  }
  cells.push_back(pool);
  double statistic = 0;
  for (const Cell& cell : cells) {
    statistic += (cell.count - cell.expected) * (cell.count - cell.expected) / cell.expected;
  }
  const double k = static_cast<double>(cells.size()) - 1;
  return (std::cbrt(statistic / k) - (1 - 2 / (9 * k))) / std::sqrt(2 / (9 * k));
}

inline constexpr double kChiSquaredThreshold = 5;

}  // namespace lightmill::test
