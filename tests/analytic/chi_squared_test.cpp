#include "tests/support/chi_squared.h"

#include <gtest/gtest.h>

namespace lightmill::test {
namespace {

TEST(ChiSquared, HasTheQuantilesOfTenDegreesOfFreedom) {
  const std::vector<double> expected(11, 100);
  // Statistics that are exceeded with probability 95 %, 50 %, 5 % and 0.1 %, and the same quantiles of a normal distribution.
  for (const auto& [statistic, z] : {std::pair(3.940, -1.645), {9.342, 0.}, {18.307, 1.645}, {29.588, 3.090}}) {
    const std::vector<double> counts(11, 100 + std::sqrt(100 * statistic / 11));
    EXPECT_NEAR(chi_squared_z(counts, expected), z, 0.05) << statistic;
  }
}

TEST(ChiSquared, RareCellsCount) {
  const std::vector<double> expected{50, 100, 100, 100, 0.3, 0.2};
  EXPECT_LT(chi_squared_z({50, 100, 100, 100, 1, 0}, expected), 0);
  EXPECT_GT(chi_squared_z({50, 100, 100, 100, 500, 500}, expected), kChiSquaredThreshold);
  EXPECT_GT(chi_squared_z({50, 100, 100, 100, 1}, {50, 100, 100, 100, 0}), kChiSquaredThreshold);
}

}  // namespace
}  // namespace lightmill::test
