// The rate behind a job's expected end.
#include "server/domain/steady_rate.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <limits>

namespace lightmill {
namespace {

constexpr double kUnknown = std::numeric_limits<double>::infinity();

TEST(SteadyRate, EqualResultsOfOneWorkerGiveTheirRate) {
  for (const double gap_s : {0.01, 0.3, 2.0, 45.0, 1000.0}) {
    SteadyRate rate;
    double now_s = 7000;
    for (int i = 0; i < 400; ++i) {
      rate.add(5, gap_s, now_s += gap_s);
    }
    const double expected_s = 2000 * gap_s;
    EXPECT_NEAR(rate.seconds_for(10'000, now_s), expected_s, 0.01 * expected_s + gap_s) << gap_s;
  }
}

TEST(SteadyRate, NothingIsPredictedFromTheFirstResultsOfARound) {
  SteadyRate rate;
  EXPECT_EQ(rate.seconds_for(1, 100), kUnknown) << "nothing has come";
  for (int worker = 0; worker < 64; ++worker) {
    rate.add(1, 10, 10 + 0.01 * worker);
    EXPECT_EQ(rate.seconds_for(1000, 10 + 0.01 * worker), kUnknown);
  }
  EXPECT_EQ(rate.seconds_for(1000, 14.9), kUnknown);
  EXPECT_NEAR(rate.seconds_for(1280, 15), 200, 10) << "64 in 10 s";
}

// 64 workers need 10 s for each result, and stay together. 6,400 results take 1,000 s.
TEST(SteadyRate, RoundsDoNotMoveThePredictedEnd) {
  SteadyRate rate;
  int done = 0;
  for (double now_s = 0; now_s < 990; now_s += 0.5) {
    const int round = static_cast<int>(now_s / 10);
    for (int worker = 0; done < 64 * round; ++worker) {
      rate.add(1, 10, 10 * round + 0.001 * worker);
      ++done;
    }
    if (now_s > 15.5) {
      EXPECT_NEAR(now_s + rate.seconds_for(6400 - done, now_s), 1000, 20) << now_s;
    }
  }
}

// Eight workers need 0.5 to 3.5 s for a result, 2 s on average. So 2,400 results take 600 s.
TEST(SteadyRate, UnequalResultsMoveThePredictedEndLittle) {
  constexpr std::array<double, 7> kTimes{0.5, 3, 1, 3.5, 2, 1.5, 2.5};
  std::array<double, 8> ready_s{};
  std::array<double, 8> took_s{};
  for (std::size_t i = 0; i < ready_s.size(); ++i) {
    ready_s[i] = took_s[i] = kTimes[i % kTimes.size()];
  }
  SteadyRate rate;
  double last_end_s = 600;
  for (int done = 1; done <= 2400; ++done) {
    const auto next = static_cast<std::size_t>(std::ranges::min_element(ready_s) - ready_s.begin());
    const double now_s = ready_s[next];
    rate.add(1, took_s[next], now_s);
    took_s[next] = kTimes[static_cast<std::size_t>(done * 3) % kTimes.size()];
    ready_s[next] += took_s[next];
    const double end_s = now_s + rate.seconds_for(2400 - done, now_s);
    if (now_s > 20) {
      EXPECT_NEAR(end_s, 600, 60) << now_s;
      EXPECT_NEAR(end_s, last_end_s, 20) << now_s;
    }
    last_end_s = end_s;
  }
}

TEST(SteadyRate, ItCountsDownWithinAPeriodAndGrowsWithoutResults) {
  SteadyRate rate;
  for (int i = 1; i <= 20; ++i) {
    rate.add(1, 1, i);
  }
  EXPECT_NEAR(rate.seconds_for(10, 20.4) - rate.seconds_for(10, 20.1), -0.3, 1e-9);
  double before_s = rate.seconds_for(10, 22);
  for (double now_s = 24; now_s < 200; now_s += 2) {
    EXPECT_GT(rate.seconds_for(10, now_s), before_s) << now_s;
    before_s = rate.seconds_for(10, now_s);
  }
  EXPECT_GT(before_s, 100);
}

TEST(SteadyRate, AfterAChangeTheOldRateIsForgotten) {
  SteadyRate rate;
  double now_s = 0;
  for (int i = 0; i < 1000; ++i) {
    rate.add(1, 1, now_s += 1);
  }
  for (int i = 0; i < 1500; ++i) {  // five minutes with five times the workers
    rate.add(1, 1, now_s += 0.2);
  }
  EXPECT_NEAR(rate.seconds_for(500, now_s), 100, 15);
}

}  // namespace
}  // namespace lightmill
