// Messages that no honest worker or client sends: the coordinator refuses them and its jobs still end.
#include "tests/unit/server/coordinator_fixture.h"

namespace lightmill {
namespace {

using test::CoordinatorTest;

TEST_F(CoordinatorTest, SecondsThatNoClockCanCountAreRefused) {
  JobSpec job = spec();
  job.goal.seconds = 1e12;
  EXPECT_EQ(coordinator->submit(job, now, unix_ms(), effects).status().code(), StatusCode::kInvalidArgument);
}

TEST_F(CoordinatorTest, NamesThatATerminalWouldObeyAreRefused) {
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

TEST_F(CoordinatorTest, AResultOfAnotherRangeAndDigestHoldsNothingBack) {
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

TEST_F(CoordinatorTest, ATimedJobWhoseResultsAreDamagedEndsWithItsFirstSampleEverywhere) {
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

TEST_F(CoordinatorTest, AWorkerCannotClaimLeasesThatWereNeverGiven) {
  const JobId job = submit(spec());
  const SessionId first = connect("w");
  const LeaseGrant grant = got<LeaseGrant>(first).at(0);
  Unit unit = grant.unit;
  unit.range = {0, 3};
  const LeaseId next{got<LeaseGrant>(first).back().lease.value + 1};
  const SessionId second = connect("v", 1, "class-a", {{next, 1, status(job).render_digest, unit}});
  ASSERT_FALSE(got<LeaseCancel>(second).empty());
  EXPECT_EQ(got<LeaseCancel>(second).front().leases, std::vector<LeaseId>{next});
}

TEST_F(CoordinatorTest, AResultOfEndlessSecondsIsRefused) {
  const JobId job = submit(spec());
  const SessionId session = connect("w");
  const LeaseGrant grant = got<LeaseGrant>(session).at(0);
  say(session, result(grant, grant.unit.tiles.front(), 1e300));
  EXPECT_EQ(status(job).counters.results_merged, 0u);
}

}  // namespace
}  // namespace lightmill
