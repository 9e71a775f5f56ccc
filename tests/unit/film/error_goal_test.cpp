// Counts at which an error goal is read, and when it is met.
#include "common/film/error_goal.h"

#include <gtest/gtest.h>

#include <cmath>

#include "common/film/sample_range.h"

namespace lightmill {
namespace {

TEST(ErrorGoal, CountsArePowersOfTwoAndHalfwayBetween) {
  std::set<std::uint64_t> counts;
  for (std::uint64_t power = 1; power <= 2 * kMaxSamples; power *= 2) {
    for (const std::uint64_t count : {power, 3 * power}) {
      if (count >= kFirstErrorCount && count <= 2 * kMaxSamples) {
        counts.insert(count);
      }
    }
  }
  for (std::uint64_t samples = 0; samples < 10'000; ++samples) {
    EXPECT_EQ(next_error_count(samples), *counts.lower_bound(samples)) << samples;
    EXPECT_EQ(next_error_count(samples) == samples, counts.contains(samples)) << samples;
  }
  for (const std::uint64_t count : counts) {
    EXPECT_EQ(next_error_count(count), count) << count;
    EXPECT_EQ(next_error_count(count - 1), count);
  }
  EXPECT_EQ(next_error_count(kMaxSamples), kMaxSamples);
}

TEST(ErrorGoal, IsMetByTheUpperEndOfTheInterval) {
  EXPECT_TRUE(meets({0.008, 0.002, true}, 0.01));
  EXPECT_FALSE(meets({0.008, 0.0021, true}, 0.01));
  EXPECT_FALSE(meets({0, 0, false}, 0.01)) << "an unknown error meets no goal";
}

TEST(ErrorGoal, IsExpectedWhereErrorsFallAsOneOverSamples) {
  EXPECT_EQ(expected_error_count({0.03, 0.01, true}, 24, 0.01), 96u);
  EXPECT_EQ(expected_error_count({0.03, 0.0101, true}, 24, 0.01), 128u);
  EXPECT_EQ(expected_error_count({0.001, 0, true}, 24, 0.01), kFirstErrorCount);
  EXPECT_EQ(expected_error_count({1e30, 0, true}, 24, 1e-30), 2 * kMaxSamples);
  EXPECT_EQ(expected_error_count({std::nan(""), 0, true}, 24, 0.01), 2 * kMaxSamples);
}

}  // namespace
}  // namespace lightmill
