// The farm's history, of moments whose work is known.
#include "server/domain/farm_history.h"

#include "tests/unit/server/coordinator_fixture.h"

namespace lightmill {
namespace {

constexpr Time kStart{std::chrono::seconds(1000)};

class FarmHistoryTest : public ::testing::Test {
 protected:
  /// The next moment, `seconds` after the one before.
  void look(double seconds = 10) {
    now_ += from_seconds(seconds);
    history_.add(load_, now_, to_unix_ms());
  }
  std::int64_t to_unix_ms() const { return static_cast<std::int64_t>(1000 * to_seconds(now_ - kStart)); }

  FarmHistory history_;
  FarmLoad load_;
  Time now_ = kStart;
};

TEST_F(FarmHistoryTest, ASampleHasTheWorkOfItsIntervalAndTheCurrentFarm) {
  load_.pixel_samples = 500;
  look();
  EXPECT_TRUE(history_.fine().empty()) << "a moment, and no interval yet";
  load_ = {800, 2, 1, {{"a", 4, 3, 0, 0, 0}, {"b", 2, 0, 0, 0, 0}}};
  look(12);
  ASSERT_EQ(history_.fine().size(), 1u);
  EXPECT_EQ(history_.fine()[0], (HistorySample{22'000, 12, 300, 2, 6, 4, 3, 2, 1}));
  EXPECT_EQ(history_.next(), now_ + FarmHistory::kInterval);
}

TEST_F(FarmHistoryTest, FiveMinutesSumTheWorkAndWeightMeansByLength) {
  look();
  for (int i = 0; i < 30; ++i) {
    load_.pixel_samples += 100;
    load_.jobs_waiting = i < 15 ? 4 : 1;
    look(i < 15 ? 10 : 20);
  }
  ASSERT_EQ(history_.coarse().size(), 1u);
  const HistorySample& all = history_.coarse()[0];
  EXPECT_EQ(all.unix_ms, to_unix_ms());
  EXPECT_DOUBLE_EQ(all.seconds, 450);
  EXPECT_DOUBLE_EQ(all.pixel_samples, 3000);
  EXPECT_DOUBLE_EQ(all.jobs_waiting, (4 * 150 + 1 * 300) / 450.0);
}

TEST_F(FarmHistoryTest, KeepsAnHourAndADay) {
  for (int i = 0; i <= 30 * 300; ++i) {
    look();
  }
  EXPECT_EQ(history_.fine().size(), FarmHistory::kFine);
  EXPECT_EQ(history_.coarse().size(), FarmHistory::kCoarse);
  EXPECT_EQ(history_.fine().back().unix_ms - history_.fine().front().unix_ms, 359 * 10'000);
  EXPECT_EQ(history_.coarse().back().unix_ms - history_.coarse().front().unix_ms, 287 * 300'000);
}

TEST_F(FarmHistoryTest, AWorkersMinutesIncludeWorkBeforeItReconnected) {
  load_.workers = {{"a", 1, 1, 10, 1, 1000}};
  look();
  for (int i = 0; i < 3; ++i) {
    load_.workers[0].results += 2;
    load_.workers[0].pixel_samples += 50;
    look();
  }
  load_.workers.clear();
  history_.depart({"a", 1, 0, 17, 3, 1200});  // work and losses since the last moment
  look();
  load_.workers = {{"a", 1, 1, 20, 4, 1300}};  // its counts started again
  look();
  look();
  const std::vector<WorkerSample> minutes = history_.of_worker("a");
  ASSERT_EQ(minutes.size(), 1u);
  EXPECT_EQ(minutes[0], (WorkerSample{70'000, 50, 17 + 20, 3 + 4, 1200 + 1300}));
  EXPECT_TRUE(history_.of_worker("b").empty());
}

TEST_F(FarmHistoryTest, AWorkerThatIsGoneForAnHourIsForgotten) {
  load_.workers = {{"a", 1, 0, 0, 0, 0}};
  look();
  look();
  load_.workers.clear();
  for (int i = 0; i < 6 * 60; ++i) {
    look();
  }
  EXPECT_EQ(history_.of_worker("a").size(), FarmHistory::kMinutes);
  for (int i = 0; i < 6; ++i) {
    look();
  }
  EXPECT_TRUE(history_.of_worker("a").empty());
}

class FarmLoadTest : public test::CoordinatorTest {};

TEST_F(FarmLoadTest, CountsIncludeMergedSamplesAndWaitingJobs) {
  const JobId job = submit(spec("r1", 4, {0, 0, 64, 64}));
  const JobId paused = submit(spec("r2", 4, {0, 0, 64, 64}));
  submit(spec("r3", 4, {0, 0, 64, 64}));
  ASSERT_TRUE(coordinator->pause(paused, now, effects).ok());
  EXPECT_EQ(coordinator->load().jobs_waiting, 2u);
  EXPECT_TRUE(coordinator->load().workers.empty());

  const SessionId session = connect("a", 3);
  const auto leases = got<LeaseGrant>(session).size();
  ASSERT_GT(leases, 0u);
  FarmLoad load = coordinator->load();
  ASSERT_EQ(load.workers.size(), 1u);
  EXPECT_EQ(load.workers[0].threads, 3u);
  EXPECT_EQ(load.workers[0].leases, leases);
  EXPECT_GE(load.jobs_running, 1u);
  EXPECT_EQ(load.jobs_running + load.jobs_waiting, 2u);

  work(session);
  load = coordinator->load();
  EXPECT_EQ(load.pixel_samples, 2u * 4 * 64 * 64);
  EXPECT_EQ(load.workers[0].pixel_samples, 2u * 4 * 64 * 64);
  EXPECT_EQ(load.jobs_running + load.jobs_waiting, 0u);
  EXPECT_EQ(status(job).state, JobState::done);
}

TEST_F(FarmLoadTest, AForgottenWorkersWorkAndLossesAreReported) {
  submit(spec("r1", 4, {0, 0, 64, 64}));
  const SessionId session = connect("a");
  const auto leases = got<LeaseGrant>(session).size();
  ASSERT_GT(leases, 0u);
  coordinator->worker_disconnected(session, now, effects);
  EXPECT_TRUE(effects.departed.empty()) << "it may return and continue";
  EXPECT_TRUE(coordinator->load().workers.empty());
  now += limits.disconnect_grace + std::chrono::milliseconds(1);
  coordinator->tick(now, unix_ms(), effects);
  ASSERT_EQ(effects.departed.size(), 1u);
  EXPECT_EQ(effects.departed[0].name, "a");
  EXPECT_EQ(effects.departed[0].leases_lost, leases);
}

}  // namespace
}  // namespace lightmill
