// Longer ranges for workers whose results wait long for their acknowledgement.
#include "server/scheduling/unit_size.h"
#include "tests/unit/server/coordinator_fixture.h"

namespace lightmill::test {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr double kMiB = 1024 * 1024;

class ResultsWaitTest : public CoordinatorTest {
 protected:
  ResultsWaitTest() {
    limits.threads_at_first = limits.tiles_at_first = 100'000;  // each worker has the threads that it claims
    restart({});
  }
  void restart_with(double bytes_per_second) {
    limits.result_bytes_per_second = bytes_per_second;
    restart({});
  }
  double rate() const { return coordinator->gauges(now).results_rate; }
  void say_wait(SessionId session, Duration wait) { say(session, WorkerHeartbeat{{}, wait}); }
  void say_nothing(SessionId session) { say(session, WorkerHeartbeat{}); }
  /// Sends the results of a lease. Returns the bytes that they take of the rate.
  double render(SessionId session, const LeaseGrant& grant) {
    double bytes = 0;
    for (const TileId tile : grant.unit.tiles) {
      WorkerResult one = result(grant, tile, 0.1 * static_cast<double>(grant.unit.range.count()));
      bytes += static_cast<double>(one.node.values.size() * sizeof(float)) + kBytesOfAResult;
      say(session, std::move(one));
    }
    return bytes;
  }
  /// Renders `leases` leases. Returns the samples of the longest range.
  std::uint64_t longest_range(SessionId session, int leases = 100) {
    std::uint64_t most = 0;
    for (int i = 0; i < leases; ++i) {
      const LeaseGrant grant = got<LeaseGrant>(session).back();
      most = std::max(most, grant.unit.range.count());
      render(session, grant);
    }
    return most;
  }
  /// A worker whose results wait long. Few results came, so the rate falls to a quarter.
  SessionId slowed(std::uint32_t threads) {
    const SessionId session = connect("w", threads);
    render(session, got<LeaseGrant>(session).at(0));
    pass(seconds(2));
    say_wait(session, seconds(10));
    EXPECT_DOUBLE_EQ(rate(), limits.result_bytes_per_second / 4);
    return session;
  }
};

TEST_F(ResultsWaitTest, RangesGrowUntilNoWorkerWaits) {
  // A thousand threads: their results of 118 KiB may be 192 MiB a second, one of each in 0.6 s.
  const JobId job = submit(spec("r1", 1u << 20, {0, 0, 192, 192}));
  const SessionId session = connect("w", 1000);
  EXPECT_EQ(longest_range(session), 8u) << "0.1 s a sample, units of up to 1.2 s";
  pass(seconds(2));
  say_wait(session, seconds(10));
  EXPECT_EQ(longest_range(session), 32u) << "few came, so that a quarter may from now on";
  for (int i = 0; i < 60; ++i) {
    pass(seconds(2));
    say_wait(session, milliseconds(10));
  }
  EXPECT_EQ(longest_range(session), 8u);
  EXPECT_EQ(status(job).state, JobState::running);
}

TEST_F(ResultsWaitTest, ALongWaitCutsTheRateToNineTenthsOfTheIntake) {
  restart_with(4 * kMiB);
  submit(spec("r1", 1u << 20, {0, 0, 1024, 1024}));
  const SessionId session = connect("w", 10);
  double bytes = 0;
  for (int i = 0; bytes < 5 * kMiB; ++i) {
    bytes += render(session, got<LeaseGrant>(session).at(static_cast<std::size_t>(i)));
  }
  pass(seconds(2));
  say_wait(session, seconds(4));
  EXPECT_DOUBLE_EQ(rate(), 0.9 * bytes / 2);
}

TEST_F(ResultsWaitTest, GrantedUnitsAreRenderedBeforeTheNextReview) {
  restart_with(40 * kMiB);  // a thousand threads' results in 2.9 s, a quarter of it in 11.5: units of 23 s
  submit(spec("r1", 1u << 20, {0, 0, 192, 192}));
  const SessionId session = slowed(1000);
  double before = rate();
  const Time changed = now;
  std::vector<double> after;
  while (after.size() < 2) {
    pass(seconds(2));
    longest_range(session, 1);
    say_wait(session, milliseconds(10));
    if (rate() != before) {
      before = rate();
      after.push_back(to_seconds(now - changed));
    }
  }
  // Twice units of 5.8 s, ten seconds for waiting results, and two of observation. Then the longest pause between
  // reviews.
  EXPECT_NEAR(after[0], 2 * 5.76 + 10 + 2, 2);
  EXPECT_NEAR(after[1] - after[0], 32, 2);
}

TEST_F(ResultsWaitTest, EachWorkerCountsOnce) {
  submit(spec("r1", 1u << 20, {0, 0, 192, 192}));
  const SessionId bad = connect("bad"), good = connect("good"), other = connect("other");
  render(good, got<LeaseGrant>(good).at(0));
  say_wait(good, milliseconds(10));
  say_wait(other, milliseconds(10));
  for (int i = 0; i < 100; ++i) {
    pass(milliseconds(100));
    say_wait(bad, std::chrono::hours(24));
    say_nothing(good);
  }
  EXPECT_EQ(rate(), limits.result_bytes_per_second);
  // Draining workers do not count.
  coordinator->worker_message(good, WorkerDraining{}, now, unix_ms(), effects);
  coordinator->worker_message(other, WorkerDraining{}, now, unix_ms(), effects);
  flush();
  render(bad, got<LeaseGrant>(bad).at(0));
  pass(seconds(2));
  say_wait(bad, std::chrono::hours(24));
  EXPECT_LT(rate(), limits.result_bytes_per_second);
}

TEST_F(ResultsWaitTest, AReportedWaitEndsWithItsConnection) {
  submit(spec("r1", 1u << 20, {0, 0, 192, 192}));
  const SessionId first = connect("w");
  say_wait(first, seconds(9));
  coordinator->worker_disconnected(first, now, effects);
  flush();
  const SessionId again = connect("w");
  render(again, got<LeaseGrant>(again).back());
  pass(seconds(2));
  say_nothing(again);
  EXPECT_EQ(rate(), limits.result_bytes_per_second);
}

TEST_F(ResultsWaitTest, AHoldDoesNotCutTheRate) {
  submit(spec("r1", 1u << 20, {0, 0, 192, 192}));
  const SessionId session = connect("w", 1000);
  const std::vector<LeaseGrant> grants = got<LeaseGrant>(session);
  render(session, grants.at(0));
  coordinator->hold("waits for space", now, effects);
  flush();
  const auto wait_for = [&](Duration time) {
    for (const Time until = now + time; now < until;) {
      pass(seconds(1));
      longest_range(session, 1);
      say_wait(session, seconds(10));
    }
  };
  wait_for(seconds(20));
  coordinator->hold("", now, effects);
  flush();
  wait_for(seconds(9));
  EXPECT_EQ(rate(), limits.result_bytes_per_second) << "results still include that time";
  wait_for(seconds(6));
  EXPECT_LT(rate(), limits.result_bytes_per_second);
}

TEST_F(ResultsWaitTest, APauseDoesNotCutTheRate) {
  submit(spec("r1", 1u << 20, {0, 0, 192, 192}));
  const SessionId session = connect("w", 1000);
  stand_still(seconds(100));
  for (int i = 0; i < 9; ++i) {
    pass(seconds(1));
    longest_range(session, 1);
    say_wait(session, seconds(10));
  }
  EXPECT_EQ(rate(), limits.result_bytes_per_second);
}

TEST_F(ResultsWaitTest, AnUnknownJobIsTriedWithHalfASecondOfResults) {
  restart_with(20 * kMiB);
  submit(spec("r1", 1u << 20, {0, 0, 192, 192}));
  const SessionId session = slowed(1);
  (void)session;
  submit(spec("r2", 1u << 20, {0, 0, 2048, 2048}));
  std::size_t tried = 0;
  for (int i = 0; i < 200; ++i) {
    for (const LeaseGrant& grant : got<LeaseGrant>(connect(fmt::format("w{}", i)))) {
      tried += grant.unit.job == JobId{2} ? grant.unit.tiles.size() : 0;
    }
  }
  EXPECT_GE(tried, 26u) << "2.5 MiB in nodes of 96 KiB";
  EXPECT_LE(tried, 34u);
}

TEST_F(ResultsWaitTest, ANoticeMarksTheBeginningAndTheEnd) {
  submit(spec("r1", 1u << 20, {0, 0, 192, 192}));
  const SessionId session = connect("w");
  std::vector<std::string> notices;
  const auto heartbeat = [&](Duration wait) {
    pass(seconds(2));
    longest_range(session, 1);
    coordinator->worker_message(session, WorkerHeartbeat{{}, wait}, now, unix_ms(), effects);
    for (const Note& note : effects.notes) {
      notices.push_back(note.text);
    }
    flush();
  };
  for (int i = 0; i < 10; ++i) {
    heartbeat(seconds(9));
  }
  ASSERT_EQ(notices.size(), 1u);
  EXPECT_EQ(
      notices[0],
      "results wait long for their acknowledgement. Workers send fewer of them, each with more samples. Check the disk "
      "and the load of the coordinator, or lower --results-rate");
  for (int i = 0; rate() < limits.result_bytes_per_second; ++i) {
    ASSERT_LT(i, 200);
    ASSERT_EQ(notices.size(), 1u);
    heartbeat(milliseconds(10));
  }
  ASSERT_EQ(notices.size(), 2u);
  EXPECT_EQ(notices[1], "workers' results no longer wait: workers send them as often as before");
}

TEST_F(ResultsWaitTest, WorkersOfALargeFarmSendHeartbeatsLessOften) {
  Duration last{};
  const auto until = [&](int workers) {
    for (int i = static_cast<int>(coordinator->load().workers.size()); i < workers; ++i) {
      last = got<Welcome>(connect(fmt::format("w{}", i))).at(0).heartbeat_interval;
    }
    return last;
  };
  EXPECT_EQ(until(1), limits.heartbeat_interval);
  EXPECT_EQ(until(1000), limits.heartbeat_interval);
  EXPECT_EQ(until(2000), seconds(4));
  EXPECT_EQ(until(3000), limits.lease_duration / 4) << "or leases would be lost";
  limits.lease_duration = std::chrono::hours(1);
  limits.silence = seconds(12);
  restart({});
  EXPECT_EQ(until(2000), seconds(3)) << "or workers would be disconnected";
}

}  // namespace
}  // namespace lightmill::test
