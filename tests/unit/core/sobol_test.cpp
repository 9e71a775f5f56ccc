#include "common/sampling/sobol.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

namespace lightmill {
namespace {

struct Point {
  float u, v;
};

std::vector<Point> points(std::uint32_t first, std::uint32_t count, std::uint32_t seed) {
  std::vector<Point> out;
  for (std::uint32_t i = 0; i < count; i += 8) {
    alignas(32) float u[8], v[8];
    const Pair8 p = sobol_pair(U8(first + i) + U8::lane_index(), U8(seed));
    p.u.store(u);
    p.v.store(v);
    for (std::uint32_t lane = 0; lane < 8 && i + lane < count; ++lane) {
      out.push_back({u[lane], v[lane]});
    }
  }
  return out;
}

// A (0,2)-sequence in base 2: every aligned block of 2^m points has exactly one in each elementary interval of area
// 2^-m.
TEST(Sobol, EveryAlignedBlockIsAZeroMTwoNet) {
  for (std::uint32_t seed : {1u, 77u, 123456u}) {
    for (std::uint32_t m = 3; m <= 10; ++m) {
      for (std::uint32_t block : {0u, 1u, 5u}) {
        const auto block_points = points(block << m, 1u << m, seed);
        for (std::uint32_t a = 0; a <= m; ++a) {
          std::set<std::pair<int, int>> cells;
          for (const Point& p : block_points) {
            cells.insert({static_cast<int>(p.u * (1 << a)), static_cast<int>(p.v * (1 << (m - a)))});
          }
          ASSERT_EQ(cells.size(), 1u << m) << "seed " << seed << " m " << m << " a " << a;
        }
      }
    }
  }
}

TEST(Sobol, NumbersLieInTheUnitInterval) {
  for (const Point& p : points(0, 1 << 16, 99)) {
    ASSERT_GE(p.u, 0.0f);
    ASSERT_LT(p.u, 1.0f);
    ASSERT_GE(p.v, 0.0f);
    ASSERT_LT(p.v, 1.0f);
  }
}

// Scrambles of two seeds are independent, so one index over many seeds correlates only by chance. With 65,536 pairs the
// correlation's standard deviation is 1/256. Five of them raise a false alarm once in 1.7 million.
TEST(Sobol, ScramblesOfDifferentSeedsAreUncorrelated) {
  for (const std::uint32_t index : {0u, 1u, 2u, 17u, 1000u}) {
    double sum = 0;
    constexpr int kPairs = 65536;
    for (int k = 0; k < kPairs; k += 8) {
      const U8 seed = U8(static_cast<std::uint32_t>(k)) + U8::lane_index();
      alignas(32) float a[8], b[8];
      sobol_pair(U8(index), decision_seed(seed, 0)).u.store(a);
      sobol_pair(U8(index), decision_seed(seed, 1)).u.store(b);
      for (int lane = 0; lane < 8; ++lane) {
        sum += (a[lane] - 0.5) * (b[lane] - 0.5) * 12;
      }
    }
    EXPECT_LT(std::abs(sum / kPairs), 5.0 / 256) << index;
  }
}

// The two halves of a pixel must be independent for (A−B)²/4 to be their variance.
TEST(Sobol, HalvesOfAPixelAreUncorrelated) {
  double sum = 0;
  int n = 0;
  for (std::uint32_t y = 0; y < 64; ++y) {
    for (std::uint32_t x = 0; x < 64; ++x) {
      alignas(32) float a[8], b[8];
      const U8 index = U8::lane_index();
      sobol_pair(index, decision_seed(U8(pixel_seed(7, x, y, 0)), 3)).u.store(a);
      sobol_pair(index, decision_seed(U8(pixel_seed(7, x, y, 1)), 3)).u.store(b);
      double mean_a = 0, mean_b = 0;
      for (int lane = 0; lane < 8; ++lane) {
        mean_a += a[lane] / 8;
        mean_b += b[lane] / 8;
      }
      sum += (mean_a - 0.5) * (mean_b - 0.5);
      ++n;
    }
  }
  // The mean of eight stratified points has variance 1/(12·64·8). The product of two independent means has its square.
  const double sigma = 1.0 / (12 * 64 * 8);
  EXPECT_LT(std::abs(sum / n), 5 * sigma / std::sqrt(n));
}

}  // namespace
}  // namespace lightmill
