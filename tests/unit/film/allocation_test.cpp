#include "common/film/allocation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace lightmill {
namespace {

Allocation of(std::vector<std::int8_t> shifts) {
  return Allocation::of(std::move(shifts)).value();
}

TEST(Allocation, PartsAreRoundedUpAndTellWhatTheFrameHas) {
  const Allocation allocation = of({-2, -1, 0, 1, 2});
  for (std::uint32_t i = 0; i < 7; ++i) {
    const TileId tile{i};
    const double share = i < 5 ? std::ldexp(1.0, static_cast<int>(i) - 2) : 1;  // tiles beyond have no shift
    for (std::uint64_t frame = 0; frame < 100; ++frame) {
      const std::uint64_t part = allocation.of_tile(tile, frame);
      EXPECT_EQ(part, static_cast<std::uint64_t>(std::ceil(static_cast<double>(frame) * share)));
      // The most of which it is the part, and the least; no other part is.
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

double inefficiency(const std::vector<TileNoise>& tiles, const Allocation& allocation, double shared) {
  double error = 0, cost = 0, most = 0;
  for (std::size_t i = 0; i < tiles.size(); ++i) {
    const double share = std::ldexp(1.0, allocation.shift(TileId{static_cast<std::uint32_t>(i)}));
    error += tiles[i].pixels * tiles[i].variance / share;
    cost += tiles[i].pixels * tiles[i].cost * share;
    most = std::max(most, share);
  }
  return error * (cost + shared * most);
}

// n ∝ √variance: two tiles of 16 and 1 are to have 4:1, at most 1 on average.
TEST(Allocate, NoiseGetsTheRootOfItsVariance) {
  const std::vector<TileNoise> tiles{{100, 16, 1}, {100, 1, 1}, {100, 1, 1}, {100, 1, 1}, {100, 1, 1}};
  const Gain gain = allocate(tiles, 0);
  EXPECT_EQ(std::vector(gain.allocation.shifts().begin(), gain.allocation.shifts().end()),
            (std::vector<std::int8_t>{1, -1, -1, -1, -1}));
  // Even: (16 + 4)·5; so: (16/2 + 4·2)·(2 + 4/2).
  EXPECT_DOUBLE_EQ(gain.gain, 100.0 / 64);
  // Where the noisy tile costs 16 times as much, that takes back what its noise gives.
  EXPECT_TRUE(allocate(std::vector<TileNoise>{{100, 16, 16}, {100, 1, 1}}, 0).allocation.even());
}

TEST(Allocate, IsEvenWhereNothingIsGained) {
  EXPECT_TRUE(allocate(std::vector<TileNoise>(9, {4096, 0.3, 5}), 0).allocation.even());
  EXPECT_TRUE(allocate(std::vector<TileNoise>(9, {4096, 0, 5}), 0).allocation.even());
  EXPECT_TRUE(allocate(std::vector<TileNoise>{}, 0).allocation.even());
  // Photons of more passes cost more than what is gained.
  const std::vector<TileNoise> tiles{{100, 16, 1}, {100, 1, 1}, {100, 1, 1}};
  EXPECT_FALSE(allocate(tiles, 0).allocation.even());
  EXPECT_TRUE(allocate(tiles, 1e6).allocation.even());
}

TEST(Allocate, GainsWhatItSaysWithAtMostOneOnAverage) {
  std::mt19937 random(5);
  std::lognormal_distribution<double> wild(0, 2), mild(0, 0.7), cost(0, 0.4);
  for (int i = 0; i < 100; ++i) {
    std::vector<TileNoise> tiles;
    const bool limited = i % 2 == 0;  // so unlike that the limits count
    double pixels = 0, root = 0, even_error = 0, even_cost = 0;
    for (int t = 0; t < 40; ++t) {
      tiles.push_back({1.0 + random() % 4096, limited ? wild(random) : mild(random), cost(random)});
      pixels += tiles.back().pixels;
      root += tiles.back().pixels * std::sqrt(tiles.back().variance * tiles.back().cost);
      even_error += tiles.back().pixels * tiles.back().variance;
      even_cost += tiles.back().pixels * tiles.back().cost;
    }
    for (const double shared : {0.0, 0.3 * pixels}) {
      const Gain gain = allocate(tiles, shared);
      const double even = inefficiency(tiles, {}, shared);
      EXPECT_NEAR(gain.gain, even / inefficiency(tiles, gain.allocation, shared), 1e-9 * gain.gain);
      double given = 0;
      for (std::size_t t = 0; t < tiles.size(); ++t) {
        given += std::ldexp(tiles[t].pixels, gain.allocation.shift(TileId{static_cast<std::uint32_t>(t)}));
      }
      EXPECT_LE(given, pixels);
      if (shared == 0) {
        // No allocation does better (Cauchy and Schwarz). Weights that are off by up to √2 either way cost at most
        // (√2 + √½)²/4 = 1.125 (Kantorovich's inequality), and limits more.
        const double best = even_error * even_cost / (root * root);
        EXPECT_LE(gain.gain, best * (1 + 1e-9));
        if (!limited) {
          EXPECT_GT(gain.gain, best / 1.125);
        }
      }
    }
  }
}

}  // namespace
}  // namespace lightmill
