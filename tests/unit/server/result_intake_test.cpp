// Results that do not enter the film.
#include "tests/unit/server/coordinator_fixture.h"

namespace lightmill {
namespace {

using LeasingTest = test::CoordinatorTest;

TEST_F(LeasingTest, DamagedResultsAreDroppedAndRenderedAgain) {
  limits.losses_alone = 100;  // more losses than this test has
  restart({});
  const JobId job = submit(spec("r1", 64));
  SessionId session;
  const auto damage = std::vector<std::function<void(WorkerResult&)>>{
      [](WorkerResult& bad) { bad.damaged = true; },
      [](WorkerResult& bad) {
        bad.node.values[3] = NAN;
        bad.hash = hash_of(bad.node);
      },
      [](WorkerResult& bad) {
        bad.node.values[3] = 2 * largest_value(bad.node.range);
        bad.hash = hash_of(bad.node);
      },
      [](WorkerResult& bad) {
        bad.node.values[3] = -0.0f;
        bad.hash = hash_of(bad.node);
      },
      [](WorkerResult& bad) {
        bad.node.values.pop_back();
        bad.hash = hash_of(bad.node);
      },
      [](WorkerResult& bad) {
        bad.node.range.index += 1;
        bad.hash = hash_of(bad.node);
      },
      [](WorkerResult& bad) { bad.key.tile = TileId{77}; },
  };
  std::uint64_t lost = 0;
  for (const auto& spoil : damage) {
    coordinator->worker_disconnected(session, now, effects);
    pass(std::chrono::hours(1));  // until the others of this machine are forgotten
    session = connect(fmt::format("w{}", next_session));
    lost = status(job).counters.leases_lost;
    const LeaseGrant grant = got<LeaseGrant>(session).at(0);
    WorkerResult bad = result(grant, grant.unit.tiles[0]);
    spoil(bad);
    const std::size_t acks = got<ResultAck>(session).size();
    say(session, bad);
    EXPECT_EQ(status(job).samples_done, 0u);
    EXPECT_EQ(got<ResultAck>(session).size(), acks + 1);
    EXPECT_EQ(status(job).counters.leases_lost, lost + 1);
    EXPECT_EQ(got<LeaseCancel>(session).size(), 1u);
  }
  for (int i = 0; i < 2; ++i) {
    EXPECT_TRUE(got<Dismissal>(session).empty());
    const LeaseGrant grant = got<LeaseGrant>(session).back();
    WorkerResult bad = result(grant, grant.unit.tiles[0]);
    bad.damaged = true;
    say(session, bad);
  }
  EXPECT_EQ(got<Dismissal>(session).size(), 1u);
  EXPECT_TRUE(coordinator->workers(now).empty());
  work(connect("honest"));
  EXPECT_EQ(status(job).state, JobState::done);
}

TEST_F(LeasingTest, AChangedResultHasAnotherHash) {
  submit(spec("r1", 4));
  const LeaseGrant grant = got<LeaseGrant>(connect("w")).at(0);
  const WorkerResult sound = result(grant, grant.unit.tiles[0]);
  EXPECT_TRUE(has_its_hash(sound));
  WorkerResult changed = sound;
  changed.node.values[3] += 1;
  EXPECT_FALSE(has_its_hash(changed));
  changed = sound;
  changed.hash.low ^= 1;
  EXPECT_FALSE(has_its_hash(changed));
}

TEST_F(LeasingTest, ResultsOfAnotherDigestOrBeyondTheGoalAreDropped) {
  const JobId job = submit(spec("r1", 4));
  const SessionId session = connect("w");
  const LeaseGrant grant = got<LeaseGrant>(session).at(0);
  WorkerResult foreign = result(grant, grant.unit.tiles[0]);
  foreign.render_digest = sha256("another scene");
  say(session, foreign);
  say(session, result({LeaseId{999}, {job, {3, 0}, {TileId{0}}}}, TileId{0}));
  EXPECT_EQ(status(job).samples_done, 0u);
  EXPECT_EQ(got<ResultAck>(session).size(), 2u);
}

TEST_F(LeasingTest, RepeatedResultsAreAcknowledgedAndDropped) {
  const JobId job = submit(spec("r1", 4));
  const SessionId session = connect("w");
  const LeaseGrant grant = got<LeaseGrant>(session).at(0);
  const WorkerResult once = result(grant, grant.unit.tiles[0]);
  say(session, once);
  const std::uint64_t done = status(job).samples_done;
  say(session, once);
  EXPECT_EQ(status(job).samples_done, done);
  EXPECT_EQ(status(job).counters.results_duplicate, 1u);
  EXPECT_EQ(got<ResultAck>(session).size(), 2u);
}

}  // namespace
}  // namespace lightmill
