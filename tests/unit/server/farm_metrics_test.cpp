// The farm's totals, which metrics show.
#include "server/domain/farm_metrics.h"

#include <numeric>

#include "tests/unit/server/coordinator_fixture.h"

namespace lightmill::test {
namespace {

class FarmTotalsTest : public CoordinatorTest {
 protected:
  const FarmTotals& totals() const { return coordinator->totals(); }
  FarmGauges gauges() const { return coordinator->gauges(now); }
  std::uint64_t pictures() const {
    const std::vector<std::uint64_t>& counts = totals().first_picture.counts();
    return std::accumulate(counts.begin(), counts.end(), std::uint64_t{0});
  }
};

TEST_F(FarmTotalsTest, RepeatedWorkIsCountedOnce) {
  submit(spec("r1", 4));  // two tiles
  const SessionId w = connect("w");
  const LeaseGrant grant = got<LeaseGrant>(w).front();
  const std::uint64_t leased = totals().leases_granted;
  EXPECT_EQ(leased, got<LeaseGrant>(w).size());
  EXPECT_EQ(gauges().leases, leased);
  EXPECT_EQ(gauges().rendering, 1u);

  say(w, result(grant, grant.unit.tiles.front()));
  say(w, result(grant, grant.unit.tiles.front()));
  EXPECT_EQ(totals().results_merged, 1u);
  EXPECT_EQ(totals().results_duplicate, 1u);
  EXPECT_EQ(totals().pixel_samples, 64u * 64);

  pass(limits.lease_duration + std::chrono::seconds(1));
  EXPECT_EQ(totals().leases_lost, totals().leases_granted) << "it has said nothing";
  work(connect("w2"));
  EXPECT_EQ(totals().pixel_samples, 4u * 128 * 64);
  EXPECT_EQ(gauges().jobs[static_cast<std::size_t>(JobState::done)], 1u);
}

TEST_F(FarmTotalsTest, EachWaitHasAReason) {
  const auto waits = [&](WaitReason reason) { return gauges().waits[static_cast<std::size_t>(reason)]; };
  const JobId job = submit(spec("r1", 4));
  EXPECT_EQ(waits(WaitReason::no_worker), 1u);
  connect("older", 1, "class-b");
  JobSpec other = spec("r2", 4);
  other.settings.renderer_version = "another";
  const JobId second = submit(other);
  EXPECT_EQ(waits(WaitReason::no_worker), 0u);
  EXPECT_EQ(waits(WaitReason::other_kind), 1u);
  EXPECT_NE(status(second).reason, "");
  EXPECT_EQ(status(job).reason, "");
  coordinator->hold("the disk is full", now, effects);
  EXPECT_EQ(waits(WaitReason::storage), 2u);
  EXPECT_EQ(waits(WaitReason::other_kind), 0u);
  coordinator->hold("", now, effects);
  ASSERT_TRUE(coordinator->quarantine_worker("older", std::string(kByHand) + "ada", true, now, effects).ok());
  flush();
  EXPECT_EQ(waits(WaitReason::quarantine), 1u);
  EXPECT_TRUE(coordinator->cancel(job, now, unix_ms(), effects).ok());
  EXPECT_EQ(waits(WaitReason::quarantine), 0u);
}

TEST_F(FarmTotalsTest, EachJobCountsOneFirstPicture) {
  submit(spec("r1", 1000));
  const SessionId w = connect("w");
  now += std::chrono::seconds(3);
  const std::size_t first_round = got<LeaseGrant>(w).size();
  for (std::size_t i = 0; i < first_round || pictures() == 0; ++i) {
    ASSERT_LT(i, got<LeaseGrant>(w).size());
    finish(w, got<LeaseGrant>(w)[i]);
  }
  EXPECT_EQ(pictures(), 1u);
  EXPECT_DOUBLE_EQ(totals().first_picture.sum(), 3.0);
  // All its work is undone, and rendered again an hour later.
  ASSERT_TRUE(coordinator->quarantine_worker("w", std::string(kByHand) + "ada", true, now, effects).ok());
  flush();
  EXPECT_EQ(coordinator->film(JobId{1})->pixel_samples(), 0u);
  now += std::chrono::hours(1);
  const SessionId other{next_session++};
  coordinator->worker_connected(other, {"w2", "another host", 1, 1, "class-a", kRendererVersion, {}, false}, now,
                                effects);
  flush();
  for (std::size_t i = 0; coordinator->film(JobId{1})->min_samples() == 0; ++i) {
    ASSERT_LT(i, got<LeaseGrant>(other).size());
    finish(other, got<LeaseGrant>(other)[i]);
  }
  EXPECT_EQ(pictures(), 1u);
}

TEST_F(FarmTotalsTest, DeletedFailedJobsStayCounted) {
  const JobId job = submit(spec());
  const SessionId w = connect("w");
  say(w, WorkerRefusal{job, "its scene does not compile", false});
  ASSERT_EQ(status(job).state, JobState::failed);
  EXPECT_EQ(gauges().jobs[static_cast<std::size_t>(JobState::failed)], 1u);
  ASSERT_TRUE(coordinator->remove(job, now, effects).ok());
  flush();
  EXPECT_EQ(gauges().jobs[static_cast<std::size_t>(JobState::failed)], 0u);
  EXPECT_EQ(totals().jobs_failed, 1u);
}

TEST_F(FarmTotalsTest, ATimedJobAddsNothingToTheQueue) {
  JobSpec timed = spec("r1", 0);
  timed.goal.seconds = 3600;
  submit(timed);
  EXPECT_EQ(gauges().free_pixel_samples, 0u);
  submit(spec("r2", 10));
  EXPECT_EQ(gauges().free_pixel_samples, 10u * 128 * 64);
}

}  // namespace
}  // namespace lightmill::test
