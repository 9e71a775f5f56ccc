#include "server/scheduling/results_pace.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace lightmill {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr double kMost = 1000;
constexpr Time kStart{seconds(100)};

TEST(ResultsPace, StaysAtTheMostWhileNobodyWaitsLong) {
  ResultsPace pace(kMost, kStart);
  for (Time now = kStart; now < kStart + seconds(60); now += milliseconds(100)) {
    pace.came(100, now);
    EXPECT_FALSE(pace.waited(milliseconds(2900), seconds(1), now));
  }
  EXPECT_EQ(pace.bytes_per_second(), kMost);
}

TEST(ResultsPace, AFewThatWaitForeverDoNotSlowTheOthersDown) {
  ResultsPace pace(kMost, kStart);
  for (int i = 0; i < 1000; ++i) {
    const Duration wait = i % 10 == 0 ? Duration(std::chrono::hours(24)) : milliseconds(500);
    EXPECT_FALSE(pace.waited(wait, seconds(1), kStart + i * milliseconds(10)));
  }
  EXPECT_EQ(pace.bytes_per_second(), kMost);
}

TEST(ResultsPace, WhatIsTooMuchIsCutToWhatCame) {
  ResultsPace pace(kMost, kStart);
  Time now = kStart;
  bool changed = false;
  for (; !changed; now += milliseconds(100)) {
    ASSERT_LE(now, kStart + seconds(2));
    pace.came(60, now);  // 21 of these in two seconds
    changed = pace.waited(seconds(4), seconds(1), now);
  }
  EXPECT_NEAR(pace.bytes_per_second(), 630, 1e-9);
}

TEST(ResultsPace, IsCutByAThirdAtLeastAndThreeQuartersAtMost) {
  for (const auto& [bytes, rate] : {std::pair(0.0, 250.0), std::pair(1e9, 700.0)}) {
    ResultsPace pace(kMost, kStart);
    pace.came(bytes, kStart);
    EXPECT_FALSE(pace.waited(seconds(9), {}, kStart));
    EXPECT_TRUE(pace.waited(seconds(9), {}, kStart + seconds(2)));
    EXPECT_DOUBLE_EQ(pace.bytes_per_second(), rate);
  }
}

TEST(ResultsPace, WhatWasGivenOutBeforeAChangeIsNotHeldAgainstIt) {
  ResultsPace pace(kMost, kStart);
  pace.came(1e9, kStart);
  Time now = kStart + seconds(2);
  ASSERT_TRUE(pace.waited(seconds(5), seconds(10), now));
  // Two units of ten seconds, and the five.
  for (const Time end = now + seconds(25); now < end; now += milliseconds(500)) {
    EXPECT_FALSE(pace.waited(seconds(100), seconds(10), now));
  }
  EXPECT_FALSE(pace.waited(milliseconds(1), seconds(10), now));
  EXPECT_TRUE(pace.waited(milliseconds(1), seconds(10), now + seconds(2)));
  EXPECT_DOUBLE_EQ(pace.bytes_per_second(), 0.7 * 1.2 * kMost);
}

TEST(ResultsPace, FindsWhatACoordinatorTakesWhereMoreWaits) {
  // One that takes 330 bytes a second, workers that send what they are told to, and what is too much waits in between.
  ResultsPace pace(kMost, kStart);
  double queue = 0, sum = 0;
  int seen = 0;
  for (Time now = kStart; now < kStart + seconds(600); now += milliseconds(100)) {
    queue += 0.1 * pace.bytes_per_second();
    const double taken = std::min(queue, 33.0);
    queue -= taken;
    pace.came(taken, now);
    (void)pace.waited(from_seconds(queue / 330), seconds(1), now);
    if (now > kStart + seconds(200)) {
      EXPECT_LT(queue / 330, 12) << "seconds";
      sum += taken;
      ++seen;
    }
  }
  EXPECT_GT(sum / seen, 0.85 * 33);
}

TEST(ResultsPace, SomeResultsComeHoweverLongTheyWait) {
  ResultsPace pace(kMost, kStart);
  for (Time now = kStart; now < kStart + seconds(3600); now += seconds(1)) {
    (void)pace.waited(seconds(10), {}, now);
  }
  EXPECT_DOUBLE_EQ(pace.bytes_per_second(), kMost / 64);
}

}  // namespace
}  // namespace lightmill
