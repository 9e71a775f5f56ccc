#include "common/methods/sample_sums.h"

#include <gtest/gtest.h>

#include <random>

namespace lightmill {
namespace {

std::vector<float> sample(std::uint64_t index, std::size_t pixels) {
  std::mt19937 random(static_cast<std::uint32_t>(index));
  std::vector<float> planes(3 * pixels);
  for (float& v : planes) {
    v = static_cast<float>(random()) * 1e-7f;
  }
  return planes;
}

Node node_of(SampleRange range, std::size_t pixels) {
  SampleSums sums;
  sums.start(range, pixels);
  for (std::uint64_t i = range.first(); i < range.end(); ++i) {
    auto planes = sample(i, pixels);
    sums.add(planes);
  }
  return sums.finish();
}

Node joined(SampleRange range, std::size_t pixels) {
  return range.level == 0 ? node_of(range, pixels)
                          : join(joined(range.left_child(), pixels), joined(range.right_child(), pixels));
}

TEST(SampleSums, ANodeHasTheBitsOfJoiningItsOneSampleNodes) {
  for (const SampleRange range : {SampleRange{0, 0}, {0, 5}, {1, 0}, {1, 7}, {3, 2}, {6, 1}}) {
    EXPECT_EQ(node_of(range, 11).values, joined(range, 11).values) << range.level << " " << range.index;
  }
}

TEST(SampleSums, AMillionSamplesLoseAlmostNoPrecision) {
  // Each of the tree's 19 additions is off by at most half a last place: 19 · 2^-24. Sequential additions would lose
  // whole per cents, and would lose all that is added to a hundred million.
  constexpr std::uint32_t kLevel = 20;
  constexpr double kHalf = 0x1p19;
  SampleSums sums;
  sums.start({kLevel, 0}, 1);
  for (std::uint32_t i = 0; i < 1u << kLevel; ++i) {
    std::vector<float> planes{0.1f, i < 2 ? 1e8f : 1.0f, i % 4 < 2 ? 0.7f : 0.3f};
    sums.add(planes);
  }
  const Node node = sums.finish();
  const double exact[] = {kHalf * static_cast<double>(0.1f), 1e8 + kHalf - 1,
                          kHalf * (static_cast<double>(0.7f) + static_cast<double>(0.3f)) / 2};
  for (std::size_t half = 0; half < 2; ++half) {
    for (std::size_t channel = 0; channel < 3; ++channel) {
      EXPECT_NEAR(node.values[3 * half + channel], exact[channel], 19 * 0x1p-24 * exact[channel]) << channel;
    }
  }
}

TEST(SampleSums, ReusedSumsStartFromZero) {
  SampleSums sums;
  for (int repeat = 0; repeat < 2; ++repeat) {
    for (const std::size_t pixels : {7u, 11u}) {
      const SampleRange range{2, 3};
      sums.start(range, pixels);
      for (std::uint64_t i = range.first(); i < range.end(); ++i) {
        auto planes = sample(i, pixels);
        sums.add(planes);
      }
      EXPECT_EQ(sums.finish().values, node_of(range, pixels).values);
    }
  }
}

TEST(SampleSums, NonFiniteSamplesCountAsZeroAndAreCounted) {
  SampleSums sums;
  sums.start({1, 0}, 2);
  std::vector<float> a{1, 2, std::nanf(""), 4, 5, 6};
  std::vector<float> b{1, 1, 1, 1, std::numeric_limits<float>::infinity(), 1};
  sums.add(a);
  sums.add(b);
  const Node node = sums.finish();
  EXPECT_EQ(node.non_finite, 2u);
  EXPECT_EQ(node.values, (std::vector<float>{0, 2, 0, 4, 0, 6, 0, 1, 0, 1, 0, 1}));
}

// A node's values are finite. So a sample does not count if a few thousand like it would overflow.
TEST(SampleSums, SamplesTooLargeToAddUpCountAsZeroAndAreCounted) {
  SampleSums sums;
  sums.start({0, 0}, 2);
  std::vector<float> planes{3e38f, 1, 0, 1e28f, 0, 1};
  sums.add(planes);
  const Node node = sums.finish();
  EXPECT_EQ(node.non_finite, 1u);
  EXPECT_EQ(node.values, (std::vector<float>{0, 1, 0, 1e28f, 0, 1, 0, 0, 0, 0, 0, 0}));
}

}  // namespace
}  // namespace lightmill
