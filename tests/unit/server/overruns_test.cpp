// Work that takes too long, and workers that send heartbeats but no results.
#include "tests/unit/server/audit_fixture.h"

namespace lightmill::test {
namespace {

class OverrunTest : public AuditTest {
 protected:
  JobId submit_unaudited(std::uint64_t samples = 64) {
    JobSpec job = spec("r1", samples, {0, 0, 64, 64});
    job.audit_share = 0;
    return submit(job);
  }
  /// The worker reports so much time on the first tile of its newest lease.
  void say_cpu(SessionId session, double seconds) {
    const LeaseGrant grant = got<LeaseGrant>(session).back();
    say(session, WorkerHeartbeat{{grant.lease}, {}, {{grant.lease, grant.unit.tiles[0], seconds}}});
  }
  double too_long() const { return limits.tile_cpu_seconds + 1; }
  /// The workers keep their newest leases until a tile may have taken too long.
  void wait_with(const std::vector<SessionId>& sessions) {
    for (const Time until = now + from_seconds(too_long()); now < until;) {
      pass(limits.heartbeat_interval);
      for (const SessionId session : sessions) {
        const std::vector<LeaseGrant> grants = got<LeaseGrant>(session);
        say(session, grants.empty() ? WorkerHeartbeat{} : WorkerHeartbeat{{grants.back().lease}});
      }
    }
  }
  /// Answers leases until one of several samples is granted.
  void grow(SessionId session) {
    while (got<LeaseGrant>(session).back().unit.range.count() == 1) {
      answer_one(session);
    }
  }
};

TEST_F(OverrunTest, ARangeThatTakesTooLongIsCutToSingleSamples) {
  limits.leases_per_worker = 1;
  restart({});
  const JobId job = submit_unaudited();
  const SessionId a = connect_on("m1", "a");
  grow(a);
  const std::size_t before = got<LeaseGrant>(a).size();
  wait_with({a});
  say_cpu(a, limits.tile_cpu_seconds);
  EXPECT_TRUE(got<LeaseCancel>(a).empty()) << "it may take so long";
  say_cpu(a, too_long());
  ASSERT_EQ(got<LeaseCancel>(a).size(), 1u);
  EXPECT_EQ(status(job).counters.leases_lost, 0u);
  worked[a] = before;
  for (int i = 0; i < 1000 && status(job).state != JobState::done; ++i) {
    answer_one(a);
  }
  EXPECT_EQ(status(job).state, JobState::done);
  for (std::size_t i = before; i < got<LeaseGrant>(a).size(); ++i) {
    EXPECT_EQ(got<LeaseGrant>(a)[i].unit.range.count(), 1u);
  }
}

TEST_F(OverrunTest, AJobFailsOnceASampleTakesTooLongForTwoIdentities) {
  limits.leases_per_worker = 1;
  restart({});
  const JobId job = submit_unaudited();
  const SessionId a = connect_on("m1", "a"), beside = connect_on("m1", "beside");
  wait_with({a, beside});
  say_cpu(a, too_long());
  EXPECT_EQ(status(job).state, JobState::queued) << "one machine says so";
  EXPECT_EQ(got<LeaseCancel>(beside).size(), 1u) << "of the same machine";
  EXPECT_EQ(status(job).reason,
            "waits for a worker of another identity: worker a refused it: samples [0, 1) of the 64x64 pixels at 0, 0 "
            "of job 1 took more than 600 s of CPU time");
  pass_with({a, beside}, std::chrono::hours(1));
  EXPECT_EQ(status(job).state, JobState::queued) << "it waits";
  const SessionId b = connect_on("m2", "b");
  ASSERT_FALSE(got<LeaseGrant>(b).empty());
  wait_with({b});
  say_cpu(b, too_long());
  EXPECT_EQ(status(job).state, JobState::failed);
  EXPECT_EQ(status(job).reason,
            "workers a and b: samples [0, 1) of the 64x64 pixels at 0, 0 of job 1 took more than 600 s of CPU time");
}

TEST_F(OverrunTest, ASecondIdentityThatIsFasterFinishesIt) {
  limits.leases_per_worker = 1;
  restart({});
  const JobId job = submit_unaudited();
  const SessionId liar = connect_on("m1", "liar");
  wait_with({liar});
  say_cpu(liar, 1e9);
  const SessionId b = connect_on("m2", "b");
  answer(b);
  EXPECT_EQ(status(job).state, JobState::done);
}

TEST_F(OverrunTest, AReportOfMoreTimeThanPassedIsIgnored) {
  submit_unaudited();
  const SessionId liar = connect_on("m1", "liar");
  say_cpu(liar, 1e9);
  EXPECT_TRUE(got<LeaseCancel>(liar).empty());
}

TEST_F(OverrunTest, OneIdentityAloneCutsNoTileForLong) {
  limits.leases_per_worker = 1;
  restart({});
  const JobId job = submit_unaudited(1 << 14);
  const SessionId liar = connect_on("m1", "liar");
  grow(liar);
  const auto longest = [&](SessionId session, std::size_t from) {
    const std::vector<LeaseGrant> grants = got<LeaseGrant>(session);
    std::uint64_t most = 0;
    for (std::size_t i = from; i < grants.size(); ++i) {
      most = std::max(most, grants[i].unit.range.count());
    }
    return most;
  };
  const auto cut_by = [&](SessionId session) {
    wait_with({session});
    say_cpu(session, too_long());
    EXPECT_EQ(got<LeaseGrant>(session).back().unit.range.count(), 1u);
  };
  cut_by(liar);
  coordinator->worker_disconnected(liar, now, effects);
  pass(limits.disconnect_grace);
  const SessionId honest = connect_on("m2", "honest");
  for (int i = 0; i < 8; ++i) {
    answer_one(honest);
  }
  EXPECT_GT(longest(honest, 0), 1u) << "another identity rendered a sample of it";
  cut_by(honest);
  const std::size_t before = got<LeaseGrant>(honest).size();
  const SessionId third = connect_on("m3", "third");
  worked[honest] = before - 1;
  for (int i = 0; i < 8; ++i) {
    answer_one(honest);
    answer_one(third);
  }
  EXPECT_EQ(longest(honest, before), 1u) << "two identities say so";
  EXPECT_EQ(longest(third, 0), 1u);
  EXPECT_EQ(status(job).state, JobState::running);
}

TEST_F(OverrunTest, ReportsAboutOthersLeasesAreIgnored) {
  const JobId job = submit_unaudited();
  const SessionId a = connect_on("m1", "a"), liar = connect_on("m2", "liar");
  const LeaseGrant grant = got<LeaseGrant>(a).at(0);
  say(liar, WorkerHeartbeat{{}, {}, {{grant.lease, grant.unit.tiles[0], 1e9}, {LeaseId{99}, TileId{0}, 1e9}}});
  say(a, WorkerHeartbeat{{grant.lease}, {}, {{grant.lease, TileId{77}, 1e9}}});
  EXPECT_TRUE(got<LeaseCancel>(a).empty());
  while (waiting(a) + waiting(liar) > 0) {
    answer(a);
    answer(liar);
  }
  EXPECT_EQ(status(job).state, JobState::done);
}

TEST_F(OverrunTest, AWorkerWithHeartbeatsButNoResultsLosesItsLease) {
  const JobId job = submit_unaudited(1);
  const SessionId idle = connect_on("m1", "idle");
  ASSERT_EQ(got<LeaseGrant>(idle).size(), 1u);
  const LeaseId held = got<LeaseGrant>(idle)[0].lease;
  const auto beat = [&](Duration time) {
    for (const Time until = now + time; now < until;) {
      pass(limits.heartbeat_interval);
      say(idle, WorkerHeartbeat{{held}});
    }
  };
  beat(std::chrono::seconds(90));
  EXPECT_EQ(status(job).reason, "waits for worker idle: no result for 90 s");
  EXPECT_EQ(status(job).counters.leases_lost, 0u);
  limits.copy_after = std::chrono::hours(10);  // no other worker is connected
  beat(limits.result_timeout() - std::chrono::seconds(90));
  EXPECT_EQ(status(job).counters.leases_lost, 1u);
  const SessionId other = connect_on("m2", "other");
  if (got<LeaseGrant>(other).empty()) {  // the idle worker has it again, because it was alone
    const LeaseId again = got<LeaseGrant>(idle).back().lease;
    ASSERT_NE(again, held);
    for (const Time until = now + limits.result_timeout(); now < until;) {
      pass(limits.heartbeat_interval);
      say(idle, WorkerHeartbeat{{again}});
      say(other, WorkerHeartbeat{});
    }
  }
  ASSERT_FALSE(got<LeaseGrant>(other).empty());
  answer(other);
  EXPECT_EQ(status(job).state, JobState::done);
}

}  // namespace
}  // namespace lightmill::test
