#include "server/scheduling/result_rate_control.h"

#include <gtest/gtest.h>

#include <deque>
#include <utility>
#include <vector>

namespace lightmill {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr double kMax = 1000;
constexpr Time kRateStart{seconds(100)};

/// Reviews the pace with these waits.
bool look(ResultRateControl& control, Time now, std::vector<Duration> waits) {
  EXPECT_TRUE(control.is_due(now));
  return control.update(waits, now);
}

/// A pace that was cut to `rate` at 102 s, when results waited 4 s. It pauses reviews for twice `unit` and these 4 s.
ResultRateControl cut_to(double rate, Duration unit = {}) {
  ResultRateControl control(kMax, kRateStart);
  control.add_result(2 * rate / 0.9, kRateStart);
  control.add_unit(unit);
  EXPECT_TRUE(look(control, kRateStart + seconds(2), {seconds(4)}));
  EXPECT_NEAR(control.bytes_per_second(), rate, 1e-9);
  return control;
}

TEST(ResultRateControl, StaysAtTheMaximumWhileWaitsAreShort) {
  ResultRateControl control(kMax, kRateStart);
  EXPECT_FALSE(control.is_due(kRateStart + milliseconds(1999)));
  for (Time now = kRateStart + seconds(2); now < kRateStart + seconds(60); now += seconds(2)) {
    control.add_result(200, now - seconds(1));
    EXPECT_FALSE(look(control, now, {milliseconds(2900), milliseconds(10)}));
  }
  EXPECT_EQ(control.bytes_per_second(), kMax);
}

TEST(ResultRateControl, AMinorityOfWorkersDoesNotSlowTheOthersDown) {
  ResultRateControl control(kMax, kRateStart);
  control.add_result(200, kRateStart);
  EXPECT_FALSE(
      look(control, kRateStart + seconds(2), {std::chrono::hours(24), seconds(2), seconds(9), seconds(2), seconds(2)}));
  control.add_result(200, kRateStart + seconds(3));
  EXPECT_TRUE(
      look(control, kRateStart + seconds(4), {std::chrono::hours(24), seconds(2), seconds(9), seconds(4), seconds(2)}));
}

TEST(ResultRateControl, OverloadCutsToNineTenthsOfTheIntake) {
  cut_to(630);
  cut_to(270);
}

TEST(ResultRateControl, IsCutByThreeQuartersAtMostAndNeverWithoutResults) {
  ResultRateControl control(kMax, kRateStart);
  EXPECT_FALSE(look(control, kRateStart + seconds(2), {seconds(9)})) << "nothing came: the intake is unknown";
  control.add_result(1, kRateStart + seconds(3));
  EXPECT_TRUE(look(control, kRateStart + seconds(4), {seconds(9)}));
  EXPECT_DOUBLE_EQ(control.bytes_per_second(), kMax / 4);
}

TEST(ResultRateControl, IsNotCutForResultsOfAnEarlierRate) {
  ResultRateControl control = cut_to(450);
  control.add_result(1000, kRateStart + seconds(6));
  EXPECT_FALSE(look(control, kRateStart + seconds(8), {seconds(9)})) << "500 are taken in, 450 asked for";
  EXPECT_NEAR(control.bytes_per_second(), 450, 1e-9);
}

TEST(ResultRateControl, UnitsFromBeforeAChangeDoNotCount) {
  ResultRateControl control = cut_to(630, seconds(10));
  const Time there = kRateStart + seconds(2 + 20 + 4);
  control.add_result(1, there - seconds(1));
  EXPECT_EQ(control.window_start(there), there);
  EXPECT_FALSE(control.is_due(there + milliseconds(1999)));
  control.add_result(1200, there);
  EXPECT_TRUE(look(control, there + seconds(2), {seconds(4)}));
  EXPECT_NEAR(control.bytes_per_second(), 0.9 * 600, 1e-9);
}

TEST(ResultRateControl, IsReviewedAfterHalfAMinuteAtAnyUnitLength) {
  const ResultRateControl control = cut_to(630, seconds(1000));
  EXPECT_TRUE(control.is_due(kRateStart + seconds(2 + 30 + 2)));
}

TEST(ResultRateControl, GrowsByAFifthWithResultsAndDoublesWhenIdle) {
  ResultRateControl control = cut_to(250);
  control.add_result(1, kRateStart + seconds(6));
  EXPECT_FALSE(look(control, kRateStart + seconds(8), {milliseconds(1500)})) << "neither long nor short";
  control.add_result(1, kRateStart + seconds(9));
  EXPECT_TRUE(look(control, kRateStart + seconds(10), {milliseconds(900)}));
  EXPECT_NEAR(control.bytes_per_second(), 300, 1e-9);
  control.add_result(1, kRateStart + seconds(11));
  EXPECT_FALSE(look(control, kRateStart + seconds(13), {})) << "no worker has reported a wait";
  EXPECT_TRUE(look(control, kRateStart + seconds(15), {}));
  EXPECT_TRUE(look(control, kRateStart + seconds(17), {}));
  EXPECT_EQ(control.bytes_per_second(), kMax);
}

TEST(ResultRateControl, AReportedWaitCountsForHalfAMinute) {
  const ResultRateControl control(kMax, kRateStart);
  EXPECT_EQ(control.window_start(kRateStart + seconds(10)), kRateStart);
  EXPECT_EQ(control.window_start(kRateStart + seconds(70)), kRateStart + seconds(40));
}

TEST(ResultRateControl, AnIntervalWithoutReportsDoesNotCount) {
  ResultRateControl control(kMax, kRateStart);
  control.add_result(1, kRateStart);
  EXPECT_FALSE(look(control, kRateStart + std::chrono::hours(10), {seconds(9)}));
  EXPECT_EQ(control.bytes_per_second(), kMax);
}

TEST(ResultRateControl, APauseDoesNotCount) {
  ResultRateControl control(kMax, kRateStart);
  control.add_result(1, kRateStart);
  control.note_stall(kRateStart + seconds(1));
  EXPECT_FALSE(control.is_due(kRateStart + seconds(12)));
  EXPECT_EQ(control.window_start(kRateStart + seconds(12)), kRateStart + seconds(11));
  EXPECT_TRUE(control.is_due(kRateStart + seconds(13)));
}

/// Ten minutes of a coordinator that takes in `taken` bytes a second. Workers follow the pace when their current units
/// are done, which take `unit` at the maximum pace. The excess waits for at most 20 s. Then workers wait, too. Returns
/// the share of `taken` that came after two minutes, and its average wait.
std::pair<double, double> after_minutes(double taken, Duration unit) {
  ResultRateControl control(kMax, kRateStart);
  std::deque<std::pair<Time, double>> sent{{kRateStart, kMax}};
  double queue = 0, all = 0, waited = 0;
  int seen = 0;
  for (Time now = kRateStart; now < kRateStart + seconds(600); now += milliseconds(100)) {
    if (sent.size() > 1 && sent[1].first <= now) {
      sent.pop_front();
    }
    queue = std::min(queue + 0.1 * sent.front().second, 20 * taken);
    const double came = std::min(queue, 0.1 * taken);
    queue -= came;
    control.add_result(came, now);
    const auto unit_now =
        Duration(static_cast<Duration::rep>(static_cast<double>(unit.count()) * kMax / control.bytes_per_second()));
    control.add_unit(unit_now);
    std::vector<Duration> waits{std::min(from_seconds(queue / taken), now - kRateStart)};
    if (control.is_due(now) && control.update(waits, now)) {
      sent.emplace_back(now + unit_now, control.bytes_per_second());
    }
    if (now > kRateStart + seconds(120)) {
      all += came;
      waited += queue / taken;
      ++seen;
    }
  }
  return {all / seen / (0.1 * taken), waited / seen};
}

TEST(ResultRateControl, FindsTheIntakeRateUnderOverload) {
  for (const double taken : {900, 330, 100}) {
    for (const Duration unit : {seconds(1), seconds(10)}) {
      const auto [part, wait] = after_minutes(taken, unit);
      EXPECT_GT(part, 0.9) << taken << ' ' << unit;
      EXPECT_LT(wait, 10) << taken << ' ' << unit;
    }
  }
}

TEST(ResultRateControl, NeverFallsBelowASixtyFourth) {
  ResultRateControl control(kMax, kRateStart);
  for (Time now = kRateStart + seconds(2); now < kRateStart + seconds(600); now += seconds(2)) {
    control.add_result(0.01, now - seconds(1));
    std::vector<Duration> waits{seconds(10)};
    if (control.is_due(now)) {
      control.update(waits, now);
    }
  }
  EXPECT_DOUBLE_EQ(control.bytes_per_second(), kMax / 64);
}

}  // namespace
}  // namespace lightmill
