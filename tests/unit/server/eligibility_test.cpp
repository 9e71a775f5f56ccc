// Workers that may render a job, and the reason of a job that none may render.
#include "tests/unit/server/coordinator_fixture.h"

namespace lightmill {
namespace {

using test::CoordinatorTest;

TEST_F(CoordinatorTest, OnlyWorkersOfTheJobsClassAndVersionRenderIt) {
  const JobId job = submit(spec("r1", 64));
  const SessionId first = connect("a", 1, "class-a");
  const SessionId other = connect("b", 1, "class-b");
  EXPECT_FALSE(got<LeaseGrant>(first).empty());
  EXPECT_TRUE(got<LeaseGrant>(other).empty());
  EXPECT_EQ(status(job).render_digest, render_digest(spec("r1", 64).settings, "class-a"));
  JobSpec newer = spec("r2");
  newer.settings.renderer_version = "lightmill-core-999";
  const JobId waiting = submit(newer);
  EXPECT_TRUE(got<LeaseGrant>(other).empty());
  EXPECT_EQ(status(waiting).state, JobState::queued);
}

TEST_F(CoordinatorTest, ARefusalFailsTheJobWithItsReason) {
  const JobId job = submit(spec());
  const SessionId session = connect("w");
  say(session, WorkerRefusal{job, "mesh 'floor' is empty"});
  EXPECT_EQ(status(job).state, JobState::failed);
  EXPECT_EQ(status(job).reason, "worker w: mesh 'floor' is empty");
}

TEST_F(CoordinatorTest, AJobTooLargeForOneWorkerGoesToOthers) {
  const JobId job = submit(spec("r1", 64));
  const SessionId small = connect("small");
  const SessionId large = connect("large");
  say(small, WorkerRefusal{job, "the scene takes 9 GiB", true});
  EXPECT_EQ(status(job).state, JobState::running);
  const std::size_t grants = got<LeaseGrant>(small).size();
  work(large);
  EXPECT_EQ(status(job).state, JobState::done) << status(job).reason;
  EXPECT_EQ(got<LeaseGrant>(small).size(), grants) << "not even copies";
  EXPECT_EQ(status(job).counters.leases_lost, 0u);
  // The small worker gets other jobs.
  submit(spec("r2", 64));
  EXPECT_GT(got<LeaseGrant>(small).size(), grants);
}

TEST_F(CoordinatorTest, AJobTooLargeForAllWorkersWaitsWithAReason) {
  const JobId job = submit(spec());
  const SessionId small = connect("small");
  say(small, WorkerRefusal{job, "the scene takes 9 GiB\nand more", true});
  EXPECT_EQ(status(job).state, JobState::queued);
  EXPECT_TRUE(status(job).reason.starts_with("waits for a larger worker: for small the scene takes 9 GiB"))
      << status(job).reason;
  EXPECT_EQ(status(job).reason.find('\n'), std::string::npos);
  // A new process may have larger limits.
  coordinator->worker_disconnected(small, now, effects);
  const SessionId again = connect("small", 1, "class-a", {}, 2);
  work(again);
  EXPECT_EQ(status(job).state, JobState::done);
}

TEST_F(CoordinatorTest, AWaitingJobExplainsWhatBlocksTheConnectedWorkers) {
  const JobId job = submit(spec("r1", 64));
  EXPECT_EQ(status(job).reason, "waits for a worker: none is connected");
  const SessionId old{next_session++};
  coordinator->worker_connected(old, {"old", "host", 1, 1, "class-a", "0.1", {}, false, "m1"}, now, effects);
  flush();
  EXPECT_EQ(status(job).reason,
            fmt::format("waits for a worker with renderer {}: old has renderer 0.1", kRendererVersion));
  const SessionId leaving = connect("leaving");
  EXPECT_EQ(status(job).reason, "");
  ASSERT_TRUE(coordinator->drain_worker("leaving", now, effects).ok());
  for (const LeaseGrant& grant : got<LeaseGrant>(leaving)) {
    say(leaving, WorkerReturn{grant.lease});
  }
  EXPECT_EQ(status(job).reason, "waits for a worker: leaving is draining");
  connect("here");
  EXPECT_EQ(status(job).reason, "");
}

TEST_F(CoordinatorTest, AClassOfTooSmallWorkersIsReplacedBeforeTheFirstSample) {
  const JobId job = submit(spec());
  const SessionId small = connect("small");
  const SessionId other = connect("other", 1, "class-b");
  EXPECT_TRUE(got<LeaseGrant>(other).empty());
  say(small, WorkerRefusal{job, "too large", true});
  EXPECT_EQ(status(job).fingerprint_class, "class-b");
  work(other);
  EXPECT_EQ(status(job).state, JobState::done);
}

TEST_F(CoordinatorTest, SecondsBeforeAllWorkersRefusedDoNotCount) {
  JobSpec timed = spec();
  timed.goal = {};
  timed.goal.seconds = 60;
  const JobId job = submit(timed);
  const SessionId small = connect("small");
  pass(limits.lease_duration / 2);
  ASSERT_GT(status(job).active_seconds, 0);
  say(small, WorkerRefusal{job, "too large", true});
  EXPECT_EQ(status(job).active_seconds, 0);
}

TEST_F(CoordinatorTest, AClassIsKeptAfterTheFirstSample) {
  const JobId job = submit(spec("r1", 64));
  const SessionId large = connect("large");
  const LeaseGrant first = got<LeaseGrant>(large).at(0);
  say(large, result(first, first.unit.tiles[0]));
  const SessionId small = connect("small");
  const SessionId other = connect("other", 1, "class-b");
  say(small, WorkerRefusal{job, "too large", true});
  say(large, WorkerRefusal{job, "too large now", true});
  EXPECT_EQ(status(job).fingerprint_class, "class-a");
  EXPECT_TRUE(got<LeaseGrant>(other).empty());
  EXPECT_NE(status(job).reason.find("waits for a larger worker"), std::string::npos) << status(job).reason;
}

}  // namespace
}  // namespace lightmill
