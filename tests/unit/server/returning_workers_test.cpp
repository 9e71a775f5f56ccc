// Leases of workers that leave, come back, or are replaced.
#include "server/domain/job.h"
#include "tests/unit/server/coordinator_fixture.h"

namespace lightmill {
namespace {

using LeasingTest = test::CoordinatorTest;

TEST_F(LeasingTest, LeasesOfADisplacedWorkerMoveAtOnceAndAreNotLost) {
  limits.max_workers = 1;
  restart({});
  const JobId job = submit(spec("r1", 1));
  const SessionId first = connect("first");
  const std::size_t leases = got<LeaseGrant>(first).size();
  ASSERT_GT(leases, 0u);
  EXPECT_TRUE(coordinator->is_full("second"));
  EXPECT_FALSE(coordinator->is_full("first")) << "it may come again";
  coordinator->evict_worker(first, now, effects);
  flush();
  EXPECT_FALSE(coordinator->is_full("second"));
  const SessionId second = connect("second");
  work(second);
  EXPECT_EQ(status(job).state, JobState::done);
  EXPECT_EQ(status(job).counters.leases_lost, 0u);
  EXPECT_EQ(got<LeaseGrant>(first).size(), leases) << "it gets no more";
}

TEST_F(LeasingTest, AReturningWorkerKeepsItsLeases) {
  const JobId job = submit(spec("r1", 1));
  const SessionId first = connect("w");
  const std::vector<LeaseGrant> grants = got<LeaseGrant>(first);
  std::vector<HeldLease> held;
  for (const LeaseGrant& grant : grants) {
    held.push_back(this->held(grant));
  }
  coordinator->worker_disconnected(first, now, effects);
  pass(std::chrono::seconds(1));
  const SessionId second = connect("w", 1, "class-a", held);
  EXPECT_TRUE(got<LeaseGrant>(second).empty());
  EXPECT_TRUE(got<LeaseCancel>(second).empty());
  EXPECT_EQ(status(job).counters.leases_lost, 0u);
  for (const LeaseGrant& grant : grants) {
    finish(second, grant);
  }
  EXPECT_EQ(status(job).state, JobState::done);
  EXPECT_EQ(status(job).counters.results_duplicate, 0u);
}

TEST_F(LeasingTest, LeasesThatAReturningWorkerLacksAreLeasedAgainAtOnce) {
  const JobId job = submit(spec("r1", 1));
  const SessionId first = connect("w");
  const std::size_t leases = got<LeaseGrant>(first).size();
  const SessionId second = connect("w");  // again: its stream broke unnoticed
  ASSERT_EQ(got<Dismissal>(first).size(), 1u);
  EXPECT_EQ(status(job).counters.leases_lost, leases);
  EXPECT_FALSE(got<LeaseGrant>(second).empty());
  // Results of the old connection still count.
  finish(first, got<LeaseGrant>(first)[0]);
  EXPECT_GT(status(job).samples_done, 0u);
}

TEST_F(LeasingTest, ANameBelongsToOneProcessWhileItSendsMessages) {
  const SessionId first = connect("w");
  const auto other = [&] { return connect("w", 1, "class-a", {}, 2); };
  const SessionId refused = other();
  ASSERT_EQ(got<Dismissal>(refused).size(), 1u);
  EXPECT_EQ(got<Dismissal>(refused)[0].reason,
            "another worker named w is connected (process 1 on host). Choose another --name, or leave it out for one "
            "that is unique");
  EXPECT_TRUE(got<Dismissal>(first).empty());
  coordinator->worker_disconnected(refused, now, effects);
  flush();
  ASSERT_EQ(coordinator->workers(now).size(), 1u);
  submit(spec("r1", 1));
  EXPECT_FALSE(got<LeaseGrant>(first).empty());

  pass(limits.lease_duration - std::chrono::milliseconds(1));
  say(first, WorkerHeartbeat{});
  pass(limits.lease_duration - std::chrono::milliseconds(1));
  EXPECT_EQ(got<Dismissal>(other()).size(), 1u);
  pass(std::chrono::milliseconds(1));
  EXPECT_TRUE(got<Dismissal>(other()).empty());  // the first worker was silent for too long, so its name is free
  EXPECT_EQ(got<Dismissal>(first).size(), 1u);
}

TEST_F(LeasingTest, ALeavingWorkerFreesItsName) {
  const SessionId first = connect("w");
  say(first, WorkerDraining{});
  EXPECT_TRUE(got<Dismissal>(connect("w", 1, "class-a", {}, 2)).empty());
  EXPECT_EQ(got<Dismissal>(first).size(), 1u);
}

TEST_F(LeasingTest, LeasesOfABrokenStreamAreLostAfterTheGracePeriod) {
  const JobId job = submit(spec("r1", 1));
  const SessionId session = connect("w");
  coordinator->worker_disconnected(session, now, effects);
  EXPECT_EQ(status(job).counters.leases_lost, 0u);
  pass(limits.disconnect_grace);
  EXPECT_EQ(status(job).counters.leases_lost, got<LeaseGrant>(session).size());
  EXPECT_TRUE(coordinator->workers(now).empty());
}

TEST_F(LeasingTest, HeldLeasesOfAnEarlierCoordinatorAreAdopted) {
  StoredState stored;
  stored.epoch = 5;
  stored.next_job_id = 2;
  JobRecord record;
  record.id = JobId{1};
  record.spec = spec("r1", 8);
  record.state = JobState::running;
  record.fingerprint_class = "class-a";
  stored.jobs.push_back({record, {}});
  restart(std::move(stored));
  const Unit unit{JobId{1}, {2, 0}, {TileId{0}, TileId{1}}};
  const Sha256 digest = render_digest(record.spec.settings, "class-a");
  const LeaseId old{(std::uint64_t{4} << 32) + 17};
  const LeaseGrant grant = granted("w", old, unit, digest);
  const SessionId another =
      connect("another", 1, "class-a", {{old, 4, sha256("another farm"), unit, grant.tags}, held(grant)});
  EXPECT_EQ(got<LeaseCancel>(another).at(0).leases.size(), 2u) << "one of another job, one of another worker";
  const SessionId session = connect("w", 1, "class-a", {held(grant)});
  EXPECT_TRUE(got<LeaseCancel>(session).empty());
  pass(limits.restart_grace);
  for (const SessionId each : {another, session}) {
    for (const LeaseGrant& other : got<LeaseGrant>(each)) {
      EXPECT_GE(other.unit.range.first(), 4u);  // [0, 4) is being rendered
    }
  }
  finish(session, grant);
  EXPECT_EQ(coordinator->film(JobId{1})->min_samples(), 4u);
}

TEST_F(LeasingTest, OnlyALeaseAfterTheJobsStartShowsThatItsClassIsStored) {
  JobRecord record;
  record.id = JobId{1};
  record.spec = spec();
  Job job(record, limits, now);
  job.start("class-a", LeaseId{4});
  job.unbind();
  job.start("class-b", LeaseId{5});
  job.came_back(LeaseId{5});
  EXPECT_FALSE(job.digest_is_durable()) << "the last lease of the class before";
  job.came_back(LeaseId{6});
  EXPECT_TRUE(job.digest_is_durable());
}

TEST_F(LeasingTest, ADrainingWorkerGetsNoMore) {
  submit(spec("r1", 1000, {0, 0, 1024, 1024}));
  const SessionId session = connect("w");
  EXPECT_EQ(coordinator->drain_worker("unknown", now, effects).code(), StatusCode::kNotFound);
  ASSERT_TRUE(coordinator->drain_worker("w", now, effects).ok());
  flush();
  EXPECT_EQ(got<DrainRequest>(session).size(), 1u);
  const std::size_t before = got<LeaseGrant>(session).size();
  finish(session, got<LeaseGrant>(session)[0]);
  EXPECT_EQ(got<LeaseGrant>(session).size(), before);
  EXPECT_TRUE(coordinator->workers(now)[0].draining);
}

}  // namespace
}  // namespace lightmill
