#include "server/scheduling/results_pace.h"

#include <gtest/gtest.h>

#include <deque>
#include <utility>
#include <vector>

namespace lightmill {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr double kMost = 1000;
constexpr Time kPaceStart{seconds(100)};

/// Reviews the pace with these waits.
bool look(ResultsPace& pace, Time now, std::vector<Duration> waits) {
  EXPECT_TRUE(pace.is_due(now));
  return pace.look(waits, now);
}

/// A pace that was cut to `rate` at 102 s, when results waited 4 s. It pauses reviews for twice `unit` and these 4 s.
ResultsPace cut_to(double rate, Duration unit = {}) {
  ResultsPace pace(kMost, kPaceStart);
  pace.came(2 * rate / 0.9, kPaceStart);
  pace.gave(unit);
  EXPECT_TRUE(look(pace, kPaceStart + seconds(2), {seconds(4)}));
  EXPECT_NEAR(pace.bytes_per_second(), rate, 1e-9);
  return pace;
}

TEST(ResultsPace, StaysAtTheMaximumWhileWaitsAreShort) {
  ResultsPace pace(kMost, kPaceStart);
  EXPECT_FALSE(pace.is_due(kPaceStart + milliseconds(1999)));
  for (Time now = kPaceStart + seconds(2); now < kPaceStart + seconds(60); now += seconds(2)) {
    pace.came(200, now - seconds(1));
    EXPECT_FALSE(look(pace, now, {milliseconds(2900), milliseconds(10)}));
  }
  EXPECT_EQ(pace.bytes_per_second(), kMost);
}

TEST(ResultsPace, AMinorityOfWorkersDoesNotSlowTheOthersDown) {
  ResultsPace pace(kMost, kPaceStart);
  pace.came(200, kPaceStart);
  EXPECT_FALSE(
      look(pace, kPaceStart + seconds(2), {std::chrono::hours(24), seconds(2), seconds(9), seconds(2), seconds(2)}));
  pace.came(200, kPaceStart + seconds(3));
  EXPECT_TRUE(
      look(pace, kPaceStart + seconds(4), {std::chrono::hours(24), seconds(2), seconds(9), seconds(4), seconds(2)}));
}

TEST(ResultsPace, OverloadCutsToNineTenthsOfTheIntake) {
  cut_to(630);
  cut_to(270);
}

TEST(ResultsPace, IsCutByThreeQuartersAtMostAndNeverWithoutResults) {
  ResultsPace pace(kMost, kPaceStart);
  EXPECT_FALSE(look(pace, kPaceStart + seconds(2), {seconds(9)})) << "nothing came: nobody knows what is taken in";
  pace.came(1, kPaceStart + seconds(3));
  EXPECT_TRUE(look(pace, kPaceStart + seconds(4), {seconds(9)}));
  EXPECT_DOUBLE_EQ(pace.bytes_per_second(), kMost / 4);
}

TEST(ResultsPace, IsNotCutForResultsOfAnEarlierPace) {
  ResultsPace pace = cut_to(450);
  pace.came(1000, kPaceStart + seconds(6));
  EXPECT_FALSE(look(pace, kPaceStart + seconds(8), {seconds(9)})) << "500 are taken in, 450 asked for";
  EXPECT_NEAR(pace.bytes_per_second(), 450, 1e-9);
}

TEST(ResultsPace, UnitsFromBeforeAChangeDoNotCount) {
  ResultsPace pace = cut_to(630, seconds(10));
  const Time there = kPaceStart + seconds(2 + 20 + 4);
  pace.came(1, there - seconds(1));
  EXPECT_EQ(pace.heard_from(there), there);
  EXPECT_FALSE(pace.is_due(there + milliseconds(1999)));
  pace.came(1200, there);
  EXPECT_TRUE(look(pace, there + seconds(2), {seconds(4)}));
  EXPECT_NEAR(pace.bytes_per_second(), 0.9 * 600, 1e-9);
}

TEST(ResultsPace, IsReviewedAfterHalfAMinuteAtAnyUnitLength) {
  const ResultsPace pace = cut_to(630, seconds(1000));
  EXPECT_TRUE(pace.is_due(kPaceStart + seconds(2 + 30 + 2)));
}

TEST(ResultsPace, GrowsByAFifthWithResultsAndDoublesWhenIdle) {
  ResultsPace pace = cut_to(250);
  pace.came(1, kPaceStart + seconds(6));
  EXPECT_FALSE(look(pace, kPaceStart + seconds(8), {milliseconds(1500)})) << "neither long nor short";
  pace.came(1, kPaceStart + seconds(9));
  EXPECT_TRUE(look(pace, kPaceStart + seconds(10), {milliseconds(900)}));
  EXPECT_NEAR(pace.bytes_per_second(), 300, 1e-9);
  pace.came(1, kPaceStart + seconds(11));
  EXPECT_FALSE(look(pace, kPaceStart + seconds(13), {})) << "nobody has said how long they wait";
  EXPECT_TRUE(look(pace, kPaceStart + seconds(15), {}));
  EXPECT_TRUE(look(pace, kPaceStart + seconds(17), {}));
  EXPECT_EQ(pace.bytes_per_second(), kMost);
}

TEST(ResultsPace, AReportedWaitCountsForHalfAMinute) {
  const ResultsPace pace(kMost, kPaceStart);
  EXPECT_EQ(pace.heard_from(kPaceStart + seconds(10)), kPaceStart);
  EXPECT_EQ(pace.heard_from(kPaceStart + seconds(70)), kPaceStart + seconds(40));
}

TEST(ResultsPace, AnIntervalWithoutReportsDoesNotCount) {
  ResultsPace pace(kMost, kPaceStart);
  pace.came(1, kPaceStart);
  EXPECT_FALSE(look(pace, kPaceStart + std::chrono::hours(10), {seconds(9)}));
  EXPECT_EQ(pace.bytes_per_second(), kMost);
}

TEST(ResultsPace, APauseDoesNotCount) {
  ResultsPace pace(kMost, kPaceStart);
  pace.came(1, kPaceStart);
  pace.stood_still(kPaceStart + seconds(1));
  EXPECT_FALSE(pace.is_due(kPaceStart + seconds(12)));
  EXPECT_EQ(pace.heard_from(kPaceStart + seconds(12)), kPaceStart + seconds(11));
  EXPECT_TRUE(pace.is_due(kPaceStart + seconds(13)));
}

/// Ten minutes of a coordinator that takes in `taken` bytes a second. Workers follow the pace when their current units
/// are done, which take `unit` at the maximum pace. The excess waits for at most 20 s. Then workers wait, too. Returns
/// the share of `taken` that came after two minutes, and its average wait.
std::pair<double, double> after_minutes(double taken, Duration unit) {
  ResultsPace pace(kMost, kPaceStart);
  std::deque<std::pair<Time, double>> sent{{kPaceStart, kMost}};
  double queue = 0, all = 0, waited = 0;
  int seen = 0;
  for (Time now = kPaceStart; now < kPaceStart + seconds(600); now += milliseconds(100)) {
    if (sent.size() > 1 && sent[1].first <= now) {
      sent.pop_front();
    }
    queue = std::min(queue + 0.1 * sent.front().second, 20 * taken);
    const double came = std::min(queue, 0.1 * taken);
    queue -= came;
    pace.came(came, now);
    const auto unit_now =
        Duration(static_cast<Duration::rep>(static_cast<double>(unit.count()) * kMost / pace.bytes_per_second()));
    pace.gave(unit_now);
    std::vector<Duration> waits{std::min(from_seconds(queue / taken), now - kPaceStart)};
    if (pace.is_due(now) && pace.look(waits, now)) {
      sent.emplace_back(now + unit_now, pace.bytes_per_second());
    }
    if (now > kPaceStart + seconds(120)) {
      all += came;
      waited += queue / taken;
      ++seen;
    }
  }
  return {all / seen / (0.1 * taken), waited / seen};
}

TEST(ResultsPace, FindsTheIntakeRateUnderOverload) {
  for (const double taken : {900, 330, 100}) {
    for (const Duration unit : {seconds(1), seconds(10)}) {
      const auto [part, wait] = after_minutes(taken, unit);
      EXPECT_GT(part, 0.9) << taken << ' ' << unit;
      EXPECT_LT(wait, 10) << taken << ' ' << unit;
    }
  }
}

TEST(ResultsPace, NeverFallsBelowASixtyFourth) {
  ResultsPace pace(kMost, kPaceStart);
  for (Time now = kPaceStart + seconds(2); now < kPaceStart + seconds(600); now += seconds(2)) {
    pace.came(0.01, now - seconds(1));
    std::vector<Duration> waits{seconds(10)};
    if (pace.is_due(now)) {
      pace.look(waits, now);
    }
  }
  EXPECT_DOUBLE_EQ(pace.bytes_per_second(), kMost / 64);
}

}  // namespace
}  // namespace lightmill
