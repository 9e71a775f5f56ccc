// Messages that no honest worker or client sends. The coordinator refuses them, and its jobs still end.
#include "tests/unit/server/coordinator_fixture.h"

namespace lightmill {
namespace {

using test::CoordinatorTest;

TEST_F(CoordinatorTest, SecondsThatNoClockCanCountAreRefused) {
  JobSpec job = spec();
  job.goal.seconds = 1e12;
  EXPECT_EQ(coordinator->submit(job, now, unix_ms(), effects).status().code(), StatusCode::kInvalidArgument);
}

TEST_F(CoordinatorTest, NamesWithControlCharactersAreRefused) {
  for (const std::string& bad :
       {std::string("a\nb"), std::string("\x1b[31mred"), std::string("\xff"), std::string(201, 'x')}) {
    for (std::string JobSpec::*field : {&JobSpec::name, &JobSpec::owner, &JobSpec::host}) {
      JobSpec job = spec();
      job.*field = bad;
      EXPECT_EQ(coordinator->submit(job, now, unix_ms(), effects).status().code(), StatusCode::kInvalidArgument);
    }
    const SessionId session = connect(bad);
    ASSERT_EQ(got<Dismissal>(session).size(), 1u);
    EXPECT_NE(got<Dismissal>(session)[0].reason.find("the worker's name"), std::string::npos);
  }
}

TEST_F(CoordinatorTest, AResultOfAnotherRangeAndDigestBlocksNothing) {
  const JobId job = submit(spec());
  const SessionId session = connect("w");
  const LeaseGrant grant = got<LeaseGrant>(session).at(0);
  for (const TileId tile : grant.unit.tiles) {
    WorkerResult wrong = result(grant, tile);
    wrong.render_digest = Sha256{};
    wrong.key.range = {0, 1};
    say(session, wrong);
  }
  worked[session] = 1;
  for (int i = 0; i < 20 && status(job).state != JobState::done; ++i) {
    pass(std::chrono::milliseconds(100));
    work(session);
  }
  EXPECT_EQ(status(job).state, JobState::done);
}

TEST_F(CoordinatorTest, ATimedJobWithDamagedResultsStillGetsItsFirstSamples) {
  JobSpec timed = spec();
  timed.goal = {};
  timed.goal.seconds = 1;
  const JobId job = submit(timed);
  const SessionId session = connect("w");
  const std::vector<LeaseGrant> grants = got<LeaseGrant>(session);
  pass(std::chrono::seconds(2));
  // The highest samples first, so that nothing below them has to be rendered again.
  for (auto grant = grants.rbegin(); grant != grants.rend(); ++grant) {
    WorkerResult damaged = result(*grant, grant->unit.tiles.front());
    damaged.node.values.front() = std::numeric_limits<float>::quiet_NaN();
    say(session, damaged);
  }
  ASSERT_EQ(status(job).state, JobState::running) << "its picture is empty";
  worked[session] = grants.size();
  work(session);
  EXPECT_EQ(status(job).state, JobState::done);
  EXPECT_EQ(coordinator->film(job)->min_samples(), 1u);
  EXPECT_EQ(coordinator->film(job)->max_samples(), 1u) << "its time is up";
}

TEST_F(CoordinatorTest, AWorkerCannotClaimUngrantedLeases) {
  const JobId job = submit(spec());
  const SessionId first = connect("w");
  const LeaseGrant grant = got<LeaseGrant>(first).at(0);
  Unit unit = grant.unit;
  unit.range = {0, 3};
  const LeaseId next{got<LeaseGrant>(first).back().lease.value + 1};
  const SessionId second = connect("v", 1, "class-a", {{next, 1, status(job).render_digest, unit, grant.tags}});
  ASSERT_FALSE(got<LeaseCancel>(second).empty());
  EXPECT_EQ(got<LeaseCancel>(second).front().leases, std::vector<LeaseId>{next});
}

TEST_F(CoordinatorTest, ForgedLeasesInHellosEndTheSession) {
  submit(spec("r1", 1024, {0, 0, 512, 64}));
  const SessionId honest = connect("honest");
  const HeldLease stolen = held(got<LeaseGrant>(honest).at(0));
  HeldLease invented = stolen;
  for (Sha256& tag : invented.tags) {
    tag = sha256("a guess");
  }
  for (std::uint32_t i = 1; i < limits.max_bad_results; ++i) {
    EXPECT_TRUE(got<Dismissal>(connect("liar", 1, "class-a", {stolen, invented})).empty()) << "one each hello";
  }
  const SessionId last = connect("liar", 1, "class-a", {invented});
  ASSERT_EQ(got<Dismissal>(last).size(), 1u);
  EXPECT_NE(got<Dismissal>(last)[0].reason.find("never granted"), std::string::npos);
  EXPECT_EQ(coordinator->workers(now).size(), 1u);
  EXPECT_TRUE(got<LeaseCancel>(honest).empty());
}

TEST_F(CoordinatorTest, StaleLeasesInHellosAreIgnored) {
  const JobId job = submit(spec("r1", 1024, {0, 0, 512, 64}));
  const SessionId first = connect("w");
  std::vector<HeldLease> leases;
  for (const LeaseGrant& grant : got<LeaseGrant>(first)) {
    leases.push_back(held(grant));
  }
  coordinator->worker_disconnected(first, now, effects);
  pass(limits.disconnect_grace);
  connect("other");  // it gets the same samples
  for (std::uint32_t i = 0; i < 2 * limits.max_bad_results; ++i) {
    EXPECT_TRUE(got<Dismissal>(connect("w", 1, "class-a", leases)).empty());
  }
  EXPECT_TRUE(coordinator->cancel(job, now, unix_ms(), effects).ok());
  flush();
  for (std::uint32_t i = 0; i < 2 * limits.max_bad_results; ++i) {
    EXPECT_TRUE(got<Dismissal>(connect("w", 1, "class-a", leases)).empty());
  }
}

TEST_F(CoordinatorTest, AnUngrantedResultIsRefused) {
  const JobId job = submit(spec("r1", 1024, {0, 0, 512, 64}));
  const SessionId honest = connect("honest", 4), liar = connect("liar", 4);
  const LeaseGrant grant = got<LeaseGrant>(liar).at(0), other = got<LeaseGrant>(honest).at(0);
  const TileId tile = grant.unit.tiles.front();
  const auto changed = [&](auto change) {
    WorkerResult wrong = result(grant, tile);
    change(wrong);
    wrong.node.range = wrong.key.range;
    wrong.node.values.resize(coordinator->film(job)->expected_values(wrong.key.tile, wrong.key.range));
    wrong.hash = hash_of(wrong.node);
    return wrong;
  };
  const std::vector<WorkerResult> forged{
      changed([](WorkerResult& wrong) {
        wrong.key.range = {10, 0};
      }),  // all samples
      changed([](WorkerResult& wrong) {
        wrong.key.range = {0, 1};
      }),
      changed([&](WorkerResult& wrong) {
        wrong.key = {job, other.unit.tiles.front(), other.unit.range};
      }),
      changed([&](WorkerResult& wrong) { wrong.lease = other.lease; }),
      changed([](WorkerResult& wrong) { wrong.tag = {}; }),
      changed([](WorkerResult& wrong) { wrong.tag.bytes[31] ^= 1; }),
      result(other, other.unit.tiles.front()),  // another worker's
  };
  for (const WorkerResult& each : forged) {
    say(connect("liar", 4), each);
  }
  EXPECT_EQ(status(job).counters.results_merged, 0u);
  EXPECT_TRUE(got<Dismissal>(honest).empty());
  // The session of a worker that sends three ends.
  const SessionId again = connect("liar", 4, "class-a", {}, 2);
  for (int i = 0; i < 3; ++i) {
    say(again, forged[0]);
  }
  EXPECT_EQ(got<Dismissal>(again).size(), 1u);
  EXPECT_EQ(got<ResultAck>(again).size(), 3u) << "or it would send them again without end";
}

TEST_F(CoordinatorTest, BadResultsCountForTheIdentityAcrossProcessesAndNames) {
  const JobId job = submit(spec("r1", 4, {0, 0, 512, 64}));
  const SessionId first = connect("liar");
  const LeaseGrant grant = got<LeaseGrant>(first).at(0);
  WorkerResult forged = result(grant, grant.unit.tiles.front());
  forged.tag = {};
  coordinator->worker_disconnected(first, now, effects);
  std::uint32_t pid = 1;
  for (std::uint32_t i = 1; i < limits.max_bad_results; ++i) {
    const SessionId session = connect("liar", 1, "class-a", {}, ++pid);
    say(session, forged);
    EXPECT_TRUE(got<Dismissal>(session).empty());
    coordinator->worker_disconnected(session, now, effects);
    pass(limits.disconnect_grace);
  }
  for (const std::string name : {"liar", "another"}) {
    const SessionId session = connect(name, 1, "class-a", {}, ++pid);
    say(session, forged);
    EXPECT_EQ(got<Dismissal>(session).size(), 1u) << name;
  }
  const SessionId honest = connect("honest", 1, "class-a", {}, ++pid);  // on the same machine
  work(honest);
  EXPECT_TRUE(got<Dismissal>(honest).empty());
  EXPECT_EQ(status(job).state, JobState::done);
  pass(std::chrono::hours(1));
  submit(spec("r2"));
  const SessionId later = connect("liar", 1, "class-a", {}, ++pid);
  const LeaseGrant next = got<LeaseGrant>(later).at(0);
  WorkerResult damaged = result(next, next.unit.tiles.front());
  damaged.hash = {};
  say(later, damaged);
  EXPECT_TRUE(got<Dismissal>(later).empty()) << "the others are forgotten";
}

TEST_F(CoordinatorTest, AGrantSurvivesALostLeaseAndARestart) {
  const JobId job = submit(spec("r1", 4));
  const SessionId first = connect("w");
  const LeaseGrant grant = got<LeaseGrant>(first).at(0);
  const WorkerResult late = result(grant, grant.unit.tiles.front());
  coordinator->worker_disconnected(first, now, effects);
  pass(limits.disconnect_grace);
  ASSERT_GT(status(job).counters.leases_lost, 0u);
  const SessionId second = connect("w");
  say(second, late);
  EXPECT_EQ(status(job).counters.results_merged, 1u);

  StoredState stored{2, {}, job.value + 1};
  JobRecord record;
  record.id = job;
  record.spec = spec("r1", 4);
  record.state = JobState::running;
  record.fingerprint_class = "class-a";
  stored.jobs.push_back({record, {}});
  restart(stored);
  const SessionId third = connect("w");
  say(third, late);
  EXPECT_EQ(status(job).counters.results_merged, 1u);

  stored.secret = sha256("another farm");
  restart(std::move(stored));
  const SessionId fourth = connect("w");
  say(fourth, late);
  EXPECT_EQ(status(job).counters.results_merged, 0u);
  ASSERT_EQ(got<Welcome>(third).size() + got<Welcome>(fourth).size(), 2u);
  EXPECT_NE(got<Welcome>(third)[0].farm, got<Welcome>(fourth)[0].farm);
}

TEST_F(CoordinatorTest, ForgedHeldLeasesAreCancelled) {
  const JobId job = submit(spec("r1", 4));
  const SessionId first = connect("w");
  HeldLease forged = held(got<LeaseGrant>(first).at(0));
  coordinator->worker_disconnected(first, now, effects);
  pass(limits.disconnect_grace);
  forged.unit.range = {2, 0};
  const SessionId second = connect("w", 1, "class-a", {forged});
  ASSERT_EQ(got<LeaseCancel>(second).size(), 1u);
  EXPECT_EQ(got<LeaseCancel>(second)[0].leases, std::vector<LeaseId>{forged.lease});
  EXPECT_TRUE(got<Dismissal>(second).empty());
  work(second);
  EXPECT_EQ(status(job).state, JobState::done);
}

TEST_F(CoordinatorTest, AResultOfInfiniteSecondsIsRefused) {
  const JobId job = submit(spec());
  const SessionId session = connect("w");
  const LeaseGrant grant = got<LeaseGrant>(session).at(0);
  say(session, result(grant, grant.unit.tiles.front(), 1e300));
  EXPECT_EQ(status(job).counters.results_merged, 0u);
}

}  // namespace
}  // namespace lightmill
