#include "common/film/allocation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace lightmill {
namespace {

Allocation of(std::vector<std::int8_t> shifts) {
  return Allocation::of(std::move(shifts)).value();
}

TEST(Allocation, PartsAreRoundedUpAndDetermineTheFramesCount) {
  const Allocation allocation = of({-2, -1, 0, 1, 2});
  for (std::uint32_t i = 0; i < 7; ++i) {
    const TileId tile{i};
    const double share = i < 5 ? std::ldexp(1.0, static_cast<int>(i) - 2) : 1;  // tiles beyond have no shift
    for (std::uint64_t frame = 0; frame < 100; ++frame) {
      const std::uint64_t part = allocation.of_tile(tile, frame);
      EXPECT_EQ(part, static_cast<std::uint64_t>(std::ceil(static_cast<double>(frame) * share)));
      // The largest and the smallest frame count with this part.
      EXPECT_GE(allocation.of_frame(tile, part), frame);
      EXPECT_LE(allocation.frame_for(tile, part), frame);
      EXPECT_EQ(allocation.of_tile(tile, allocation.frame_for(tile, part)), part);
      EXPECT_EQ(allocation.of_tile(tile, allocation.of_frame(tile, part)), part);
      EXPECT_GT(allocation.of_tile(tile, allocation.of_frame(tile, part) + 1), part);
      if (allocation.frame_for(tile, part) > 0) {
        EXPECT_LT(allocation.of_tile(tile, allocation.frame_for(tile, part) - 1), part);
      }
    }
  }
  EXPECT_TRUE(Allocation().even());
  EXPECT_EQ(Allocation::of({0, 3}).status().message(), "allocation: tile 1 has shift 3, which must be from -2 to 2");
}

/// relMSE × cost, if twice the samples halve the error, and half the samples give four times the error.
double inefficiency(const std::vector<TileNoise>& tiles, const std::vector<int>& shifts, double shared) {
  double error = 0, cost = 0, most = 0;
  for (std::size_t i = 0; i < tiles.size(); ++i) {
    const double share = std::exp2(shifts[i]);
    error += tiles[i].pixels * tiles[i].variance / (shifts[i] < 0 ? share * share : share);
    cost += tiles[i].pixels * tiles[i].cost * share;
    most = std::max(most, share);
  }
  return error * (cost + shared * most);
}

double mean_share(const std::vector<TileNoise>& tiles, const std::vector<int>& shifts) {
  double sum = 0, pixels = 0;
  for (std::size_t i = 0; i < tiles.size(); ++i) {
    sum += tiles[i].pixels * std::exp2(shifts[i]);
    pixels += tiles[i].pixels;
  }
  return sum / pixels;
}

/// Whether tiles have at most one sample on average, and no tile below the greatest shift can have twice its samples.
bool spends_all(const std::vector<TileNoise>& tiles, const std::vector<int>& shifts) {
  const int most = *std::ranges::max_element(shifts);
  bool more_fits = false;
  for (std::size_t i = 0; i < tiles.size(); ++i) {
    std::vector<int> more = shifts;
    ++more[i];
    more_fits = more_fits || (shifts[i] < most && mean_share(tiles, more) <= 1);
  }
  return mean_share(tiles, shifts) <= 1 && !more_fits;
}

std::vector<int> shifts_of(const AllocationResult& result, std::size_t tiles) {
  std::vector<int> shifts;
  for (std::uint32_t i = 0; i < tiles; ++i) {
    shifts.push_back(result.allocation.shift(TileId{i}));
  }
  return shifts;
}

// One tile of variance 100 and four of 1 get 2, 1, 1, ½ and ½: (100/2 + 2·1 + 2·4)·5. A uniform allocation has (100 +
// 4)·5.
TEST(Allocate, NoisyTilesGetMore) {
  const std::vector<TileNoise> tiles{{10, 100, 1}, {10, 1, 1}, {10, 1, 1}, {10, 1, 1}, {10, 1, 1}};
  const AllocationResult result = allocate(tiles, 0);
  EXPECT_EQ(shifts_of(result, 5), (std::vector<int>{1, 0, 0, -1, -1}));
  EXPECT_DOUBLE_EQ(result.gain, 520.0 / 300);
  // If the noisy tile costs as much more, its noise gives no gain.
  EXPECT_TRUE(allocate(std::vector<TileNoise>{{10, 100, 100}, {10, 1, 1}}, 0).allocation.even());
}

TEST(Allocate, IsUniformWithoutAGain) {
  EXPECT_TRUE(allocate(std::vector<TileNoise>(9, {4096, 0.3, 5}), 0).allocation.even());
  EXPECT_TRUE(allocate(std::vector<TileNoise>(9, {4096, 0, 5}), 0).allocation.even());
  EXPECT_TRUE(allocate(std::vector<TileNoise>{}, 0).allocation.even());
  // The photons of more passes cost more than the gain.
  const std::vector<TileNoise> tiles{{100, 16, 1}, {100, 1, 1}, {100, 1, 1}};
  EXPECT_FALSE(allocate(tiles, 0).allocation.even());
  EXPECT_TRUE(allocate(tiles, 1e6).allocation.even());
}

// A request for n samples gets n, for any number of noisy tiles and any noise of the others.
TEST(Allocate, SpendsTheRequestedSamples) {
  for (const std::size_t count : {64u, 65u, 1000u}) {
    for (const std::size_t noisy : {1u, 6u, 15u, 16u, 30u, 60u}) {
      for (const double quiet : {0.0, 0.01, 1.0}) {
        std::vector<TileNoise> tiles(count, {4096, quiet, 1});
        for (std::size_t i = 0; i < noisy; ++i) {
          tiles[i * count / noisy] = {4096, 500, 1};
        }
        const double share = mean_share(tiles, shifts_of(allocate(tiles, 0), count));
        EXPECT_GT(share, 0.97) << noisy << " of " << count << " are noisy";
        EXPECT_LE(share, 1);
      }
    }
  }
}

// Compared with all allocations of five tiles that have one sample on average, up to a rest that fits no tile's next
// step.
TEST(Allocate, IsNearlyOptimal) {
  constexpr std::size_t kTiles = 5;
  std::mt19937 random(5);
  std::lognormal_distribution<double> variance(0, 2), cost(0, 0.5);
  double ratios = 0, gains = 0;
  constexpr int kRuns = 60;
  for (int run = 0; run < kRuns; ++run) {
    std::vector<TileNoise> tiles;
    double pixels = 0;
    for (std::size_t t = 0; t < kTiles; ++t) {
      tiles.push_back({1.0 + random() % 4096, variance(random), cost(random)});
      pixels += tiles.back().pixels;
    }
    const double shared = run % 2 == 0 ? 0 : 0.3 * pixels;
    const AllocationResult result = allocate(tiles, shared);
    const double even = inefficiency(tiles, std::vector<int>(kTiles, 0), shared);
    EXPECT_NEAR(result.gain, even / inefficiency(tiles, shifts_of(result, kTiles), shared), 1e-9 * result.gain);
    EXPECT_TRUE(spends_all(tiles, shifts_of(result, kTiles)) || result.allocation.even());
    double best = 1;
    for (int code = 0; code < 3125; ++code) {
      std::vector<int> shifts;
      for (int rest = code; shifts.size() < kTiles; rest /= 5) {
        shifts.push_back(rest % 5 + Allocation::kMinDoublings);
      }
      if (spends_all(tiles, shifts)) {
        best = std::max(best, even / inefficiency(tiles, shifts, shared));
      }
    }
    EXPECT_LE(result.gain, best * (1 + 1e-9));
    ratios += result.gain / best / kRuns;
    gains += best / kRuns;
  }
  EXPECT_GT(gains, 1.2) << "or there is nothing to be found";
  EXPECT_GT(ratios, 0.9);
}

}  // namespace
}  // namespace lightmill
