// Numbers that paths draw: decisions, and channels of colour.
#include <gtest/gtest.h>

#include <set>

#include "common/methods/tracer/drawn_channel.h"
#include "common/methods/tracer/sample_plan.h"

namespace lightmill::tracer {
namespace {

TEST(Decisions, HaveDifferentNumbersWithinASample) {
  std::set<std::uint32_t> numbers{kFilterDecision, kLensDecision};
  std::size_t count = 2;
  // Includes the largest number of bounces that the client allows.
  for (const std::uint32_t bounce : {0u, 1u, 2u, 3u, 999u, 1'000u, 999'999u, 1'000'000u}) {
    for (const std::uint32_t decision :
         {light_decision(bounce), light_decision(bounce, 1), light_decision(bounce, 3), bsdf_decision(bounce),
          choice_decision(bounce), connection_decision(bounce), medium_decision(bounce, 0), medium_decision(bounce, 1),
          medium_decision(bounce, kMaxPassed), inscattering_decision(bounce, 0), inscattering_decision(bounce, 1),
          inscattering_decision(bounce, kMaxPassed)}) {
      numbers.insert(decision);
      ++count;
    }
  }
  EXPECT_EQ(numbers.size(), count);
}

TEST(SamplePlan, SplitPathsOfAHalfTakeConsecutivePoints) {
  for (const std::uint32_t splits : {1u, 2u, 4u, 8u}) {
    for (const std::uint32_t split_below : {2u, 16u, 64u, 256u}) {
      for (const std::uint64_t half : {0, 1}) {
        std::uint32_t next = 0;
        for (std::uint64_t sample = half; sample < 512; sample += 2) {
          const SamplePlan plan(sample, {.splits = splits, .split_below = split_below});
          EXPECT_EQ(plan.splits, sample < split_below ? splits : 1);
          EXPECT_EQ(plan.split_index, next) << "sample " << sample << ", " << splits << " below " << split_below;
          next += plan.splits;
        }
      }
    }
  }
}

float drawn(const Vec3& share, float u) {
  alignas(32) float out[8];
  drawn_channel(broadcast(Vec3(1, 2, 4)), broadcast(share), F8(u)).store(out);
  return out[5];
}

TEST(DrawnChannel, FollowsTheSharesOfTheChannels) {
  const Vec3 share(0.25f, 0.5f, 0.25f);
  EXPECT_EQ(drawn(share, 0), 1);
  EXPECT_EQ(drawn(share, 0.24f), 1);
  EXPECT_EQ(drawn(share, 0.25f), 2);
  EXPECT_EQ(drawn(share, 0.74f), 2);
  EXPECT_EQ(drawn(share, 0.75f), 4);
  EXPECT_EQ(drawn(share, 0x1.fffffep-1f), 4);
}

// The sum of rounded shares can be below the largest number drawn.
TEST(DrawnChannel, NeverHasAShareOfZero) {
  const float last = 0x1.fffffep-1f, below_one = 0x1.fffffcp-1f;
  EXPECT_EQ(drawn(Vec3(below_one / 2, below_one / 2, 0), last), 1);
  EXPECT_EQ(drawn(Vec3(0.25f, below_one - 0.25f, 0), last), 2);
  EXPECT_EQ(drawn(Vec3(below_one, 0, 0), last), 1);
  EXPECT_EQ(drawn(Vec3(0, below_one, 0), last), 2);
  EXPECT_EQ(drawn(Vec3(0, 0, below_one), last), 4);
  int wrong = 0;
  for (int i = 1; i < 1000; ++i) {
    // Shares as media compute them.
    const auto x = static_cast<float>(i), y = static_cast<float>(i * 7919 % 1000 + 1);
    const float scale = 1.0f / (x + y);
    wrong += drawn(Vec3(x * scale, y * scale, 0), last) == 4;
    wrong += drawn(Vec3(x * (1.0f / x), 0, 0), last) != 1;
  }
  EXPECT_EQ(wrong, 0);
}

}  // namespace
}  // namespace lightmill::tracer
