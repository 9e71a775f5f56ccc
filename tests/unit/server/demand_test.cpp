// The number of workers that a farm could use.
#include "tests/unit/server/coordinator_fixture.h"

namespace lightmill::test {
namespace {

class DemandTest : public CoordinatorTest {
 protected:
  std::uint32_t wanted() const { return coordinator->wanted_workers(now); }
  /// Sends the first tile that a worker was given, with this time of one thread.
  void answer_first(SessionId session, double seconds) {
    const LeaseGrant grant = got<LeaseGrant>(session).front();
    say(session, result(grant, grant.unit.tiles.front(), seconds));
  }
  /// Sends heartbeats with its leases for this time, and no result.
  void render_on(SessionId session, int seconds) {
    WorkerHeartbeat heartbeat;
    for (const LeaseGrant& grant : got<LeaseGrant>(session)) {
      heartbeat.leases.push_back(grant.lease);
    }
    for (int i = 0; i < seconds; ++i) {
      pass(std::chrono::seconds(1));
      say(session, heartbeat);
    }
  }
};

TEST_F(DemandTest, NoJobWantsNoWorkerAndTheFirstJobWantsOne) {
  EXPECT_EQ(wanted(), 0u);
  connect("w");
  EXPECT_EQ(wanted(), 0u) << "connected workers have nothing to do";
  coordinator->worker_disconnected(SessionId{1}, now, effects);
  flush();
  const JobId job = submit(spec());
  EXPECT_EQ(wanted(), 1u);
  ASSERT_TRUE(coordinator->pause(job, now, effects).ok());
  flush();
  EXPECT_EQ(wanted(), 0u);
  ASSERT_TRUE(coordinator->resume(job, now, effects).ok());
  flush();
  EXPECT_EQ(wanted(), 1u);
  ASSERT_TRUE(coordinator->cancel(job, now, unix_ms(), effects).ok());
  flush();
  EXPECT_EQ(wanted(), 0u);
}

TEST_F(DemandTest, EachWantedWorkerHasAMinutesWork) {
  // 100 samples of two tiles at 1 s of one thread: 200 s. The first sample is done.
  submit(spec("r1", 100));
  const SessionId w = connect("w", 1);
  EXPECT_EQ(wanted(), 1u) << "its cost is unknown";
  answer_first(w, 1.0);
  EXPECT_EQ(wanted(), 4u) << "199 s";
  connect("w2", 1);
  EXPECT_EQ(wanted(), 4u) << "the number of connected workers does not matter";
  connect("large", 4);
  EXPECT_EQ(wanted(), 3u) << "with a mean of two threads, two would do, but all three have work";
}

TEST_F(DemandTest, BusyWorkersAreWanted) {
  submit(spec("r1", 4, {0, 0, 1024, 64}));  // sixteen tiles of four samples
  std::vector<SessionId> workers;
  for (const char* const name : {"a", "b", "c"}) {
    workers.push_back(connect(name));
  }
  answer_first(workers[0], 0.01);
  EXPECT_EQ(wanted(), 3u) << "0.63 s are left, and all have some of it";
  ASSERT_TRUE(coordinator->drain_worker("c", now, effects).ok());
  flush();
  EXPECT_EQ(wanted(), 2u) << "a draining worker does not count";
}

TEST_F(DemandTest, NoMoreWorkersAreWantedInTheLastMinute) {
  JobSpec job = spec("r1", 100);  // 200 s of one thread
  job.goal.seconds = 90;
  submit(job);
  const SessionId w = connect("w", 1);
  answer_first(w, 1.0);
  EXPECT_EQ(wanted(), 4u) << "199 s";
  render_on(w, 40);
  EXPECT_EQ(wanted(), 1u) << "50 s are left";
  render_on(w, 60);
  EXPECT_EQ(wanted(), 1u) << "its time is up, and it waits for its leases";
}

TEST_F(DemandTest, JobsOfUnknownCostWantTheConnectedWorkersOnce) {
  JobSpec first = spec("r1", 100'000);
  first.priority = 1;
  submit(first);
  for (const char* const name : {"r2", "r3", "r4"}) {
    submit(spec(name, 100));
  }
  connect("w", 1);
  connect("w2", 1);
  EXPECT_EQ(wanted(), 2u);
}

TEST_F(DemandTest, ATimedJobWantsAThreadForEachTile) {
  JobSpec job = spec("r1", 0, {0, 0, 640, 64});
  job.goal.seconds = 3600;
  submit(job);
  const SessionId w = connect("w", 4);
  answer_first(w, 0.01);
  EXPECT_EQ(wanted(), 3u) << "ten tiles, four threads each";
}

TEST_F(DemandTest, AnUnknownErrorWantsTheSamplesThatMeasureIt) {
  // Up to 16 samples of two tiles at 10 s, until the error is read: 320 s. 10 s are done.
  JobSpec job = spec("r1", 0);
  job.goal.error = 0.01;
  submit(job);
  const SessionId w = connect("w", 1);
  answer_first(w, 10.0);
  EXPECT_EQ(wanted(), 6u) << "310 s";
}

TEST_F(DemandTest, JobsAreAddedUp) {
  submit(spec("r1", 46));  // 92 s
  submit(spec("r2", 46));
  const SessionId w = connect("w", 1);
  const std::vector<LeaseGrant> grants = got<LeaseGrant>(w);
  ASSERT_GE(grants.size(), 2u);
  ASSERT_NE(grants[0].unit.job, grants[1].unit.job);
  for (const LeaseGrant& grant : {grants[0], grants[1]}) {
    say(w, result(grant, grant.unit.tiles.front(), 1.0));
  }
  EXPECT_EQ(wanted(), 4u) << "182 s; each alone wants two";
}

TEST_F(DemandTest, AJobThatConnectedWorkersCannotRenderWantsOneMore) {
  const JobId job = submit(spec("r1", 1000));
  const SessionId w = connect("w", 1);
  answer_first(w, 1.0);
  EXPECT_EQ(wanted(), 34u) << "1999 s";
  say(w, WorkerRefusal{job, "too large", true});
  connect("w2", 1, "class-b");
  EXPECT_NE(status(job).reason, "");
  EXPECT_EQ(wanted(), 1u) << "more of the same would wait, too";
}

TEST_F(DemandTest, AQuarantinedWorkerCountsButDoesNoWork) {
  submit(spec("r1", 1000));
  const SessionId w = connect("w", 1);
  answer_first(w, 1.0);
  ASSERT_TRUE(coordinator->quarantine_worker("w", std::string(kByHand) + "ada", false, now, effects).ok());
  flush();
  EXPECT_EQ(wanted(), 2u) << "one that renders, beside it";
}

TEST_F(DemandTest, WantsWorkersFollowsJobsAndHolds) {
  EXPECT_FALSE(coordinator->wants_workers());
  const JobId job = submit(spec("r1", 1000));
  EXPECT_TRUE(coordinator->wants_workers());
  coordinator->hold("waits for room on the disk", now, effects);
  EXPECT_FALSE(coordinator->wants_workers());
  EXPECT_EQ(coordinator->held(), "waits for room on the disk");
  coordinator->hold("", now, effects);
  ASSERT_TRUE(coordinator->cancel(job, now, unix_ms(), effects).ok());
  flush();
  EXPECT_FALSE(coordinator->wants_workers());
}

TEST_F(DemandTest, DemandStaysWithinTheWorkerLimit) {
  limits.max_workers = 7;
  restart({});
  submit(spec("r1", 1000));
  const SessionId w = connect("w", 1);
  answer_first(w, 1.0);
  EXPECT_EQ(wanted(), 7u);
}

TEST_F(DemandTest, AFarmOnHoldWantsNoWorkers) {
  submit(spec("r1", 1000));
  coordinator->hold("waits for room on the disk", now, effects);
  flush();
  connect("w", 1);
  EXPECT_EQ(wanted(), 0u);
  coordinator->hold("", now, effects);
  flush();
  EXPECT_EQ(wanted(), 1u);
}

}  // namespace
}  // namespace lightmill::test
