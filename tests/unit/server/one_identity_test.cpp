// Limits of the harm that one worker identity can do to a job, under any names and in any number of processes.
#include "server/domain/pending_audits.h"
#include "tests/support/film_planes.h"
#include "tests/unit/server/audit_fixture.h"

namespace lightmill::test {
namespace {

class OneIdentityTest : public AuditTest {
 protected:
  /// A worker with the certificate of `identity`.
  SessionId join(const std::string& identity, const std::string& name, std::uint32_t pid = 1, std::uint32_t threads = 1,
                 std::vector<HeldLease> held = {}) {
    return connect_as(
        {name, "host", pid, threads, "class-a", kRendererVersion, std::move(held), false, "machine", false, identity});
  }
  /// Streams of a worker break, and each time another process comes under its name. Returns the session of the last one.
  SessionId restart_worker(SessionId session, const std::string& identity, const std::string& name, int times) {
    for (int i = 0; i < times; ++i) {
      coordinator->worker_disconnected(session, now, effects);
      flush();
      now += std::chrono::milliseconds(10);
      session = join(identity, name, ++last_pid);
    }
    return session;
  }
  std::uint32_t last_pid = 1;
  JobId submit_unaudited(const std::string& request, std::int32_t priority = 0, PixelRect crop = {0, 0, 64, 64}) {
    JobSpec job = spec(request, 1, crop);
    job.audit_share = 0;
    job.priority = priority;
    return submit(job);
  }
  /// All leases of a session that it was sent, for its heartbeats.
  std::vector<LeaseId> leases_of(SessionId session) const {
    std::vector<LeaseId> leases;
    for (const LeaseGrant& grant : got<LeaseGrant>(session)) {
      leases.push_back(grant.lease);
    }
    return leases;
  }
  /// Time passes while these workers say that they still work on all that they got.
  void beat(const std::vector<SessionId>& sessions, Duration time) {
    for (const Time until = now + time; now < until;) {
      pass(std::min<Duration>(limits.heartbeat_interval, until - now));
      for (const SessionId session : sessions) {
        say(session, WorkerHeartbeat{leases_of(session)});
      }
    }
  }
  /// The stream breaks, and the same process comes back with its last lease.
  SessionId reconnect(SessionId session, const std::string& identity, const std::string& name) {
    const LeaseGrant grant = got<LeaseGrant>(session).back();
    coordinator->worker_disconnected(session, now, effects);
    flush();
    return join(identity, name, 1, 1, {held(grant)});
  }
};

TEST_F(OneIdentityTest, CannotFailAJobAlone) {
  limits.leases_per_worker = 1;
  restart({});
  const JobId other = submit_unaudited("other");
  const SessionId honest = join("honest", "b");
  ASSERT_EQ(waiting(honest), 1u);
  const JobId job = submit_unaudited("job", 1);
  restart_worker(join("liar", "a"), "liar", "a", 20);
  EXPECT_NE(status(job).state, JobState::failed) << status(job).reason;
  answer(honest);
  EXPECT_EQ(status(job).state, JobState::done) << status(job).reason;
  EXPECT_EQ(status(other).state, JobState::done);
}

TEST_F(OneIdentityTest, FailsAJobOnlyIfAnotherCannotRenderItEither) {
  limits.leases_per_worker = 1;
  restart({});
  submit_unaudited("other");
  const SessionId other = join("other", "b");
  const JobId job = submit_unaudited("job", 1);
  restart_worker(join("one", "a"), "one", "a", 20);
  answer_one(other);
  ASSERT_EQ(waiting(other), 1u);
  beat({other}, limits.result_timeout() - std::chrono::seconds(1));
  EXPECT_EQ(status(job).state, JobState::running);
  beat({other}, std::chrono::seconds(2));
  EXPECT_EQ(status(job).state, JobState::failed);
  EXPECT_NE(status(job).reason.find("; worker b: no result for 1200 s"), std::string::npos) << status(job).reason;
}

TEST_F(OneIdentityTest, LosesItsLeaseEvenIfItReconnectsRepeatedly) {
  const JobId job = submit_unaudited("r1");
  SessionId liar = join("liar", "a");
  const std::vector<LeaseId> first = leases_of(liar);
  ASSERT_EQ(first.size(), 1u);
  const Duration nearly = limits.result_timeout() - std::chrono::minutes(1);
  const LeaseGrant grant = got<LeaseGrant>(liar).front();
  const auto beat_on = [&](Duration time) {
    for (const Time until = now + time; now < until;) {
      pass(std::min<Duration>(limits.heartbeat_interval, until - now));
      say(liar, WorkerHeartbeat{first});
    }
  };
  beat_on(nearly);
  EXPECT_EQ(status(job).counters.leases_lost, 0u);
  coordinator->worker_disconnected(liar, now, effects);
  liar = join("liar", "a", 1, 1, {held(grant)});
  EXPECT_TRUE(got<LeaseCancel>(liar).empty());
  beat_on(nearly);
  EXPECT_GT(status(job).counters.leases_lost, 0u);
}

TEST_F(OneIdentityTest, ItsSuspectTileIsCopiedToAnotherIdentity) {
  const JobId job = submit_unaudited("r1");
  const SessionId liar = restart_worker(join("liar", "a"), "liar", "a", static_cast<int>(limits.losses_before_alone));
  ASSERT_EQ(waiting(liar), 1u);
  const SessionId honest = join("honest", "b");
  beat({liar, honest}, std::chrono::seconds(10));
  ASSERT_EQ(waiting(honest), 1u);
  answer(honest);
  EXPECT_EQ(status(job).state, JobState::done);
}

TEST_F(OneIdentityTest, CannotHoldATileAndItsCopy) {
  const JobId job = submit_unaudited("r1");
  const SessionId liar = join("liar", "a"), again = join("liar", "a2");
  beat({liar, again}, std::chrono::seconds(10));
  ASSERT_EQ(waiting(liar), 1u);
  ASSERT_EQ(waiting(again), 1u) << "workers of one identity may copy each other's work";
  const SessionId third = join("liar", "a3"), honest = join("honest", "b");
  beat({liar, again, third, honest}, std::chrono::seconds(10));
  EXPECT_EQ(waiting(third), 0u);
  ASSERT_EQ(waiting(honest), 1u);
  answer(honest);
  EXPECT_EQ(status(job).state, JobState::done);
}

TEST_F(OneIdentityTest, CannotHoldAPilotAndItsCopy) {
  JobSpec undecided = spec("r1");
  undecided.settings.method = "auto";
  ASSERT_TRUE(
      coordinator->submit(undecided, now, unix_ms(), effects, {true, {"two do"}, {}, {"path", "caustic"}}).ok());
  const SessionId liar = join("liar", "a"), again = join("liar", "a2");
  const auto beat_pilots = [&](const std::vector<SessionId>& sessions) {
    for (int i = 0; i < 5; ++i) {
      pass(limits.heartbeat_interval);
      for (const SessionId session : sessions) {
        std::vector<LeaseId> leases;
        for (const PilotGrant& grant : got<PilotGrant>(session)) {
          leases.push_back(grant.lease);
        }
        say(session, WorkerHeartbeat{leases});
      }
    }
  };
  beat_pilots({liar, again});
  ASSERT_EQ(got<PilotGrant>(again).size(), 1u);
  const SessionId third = join("liar", "a3"), honest = join("honest", "b");
  beat_pilots({liar, again, third, honest});
  EXPECT_EQ(got<PilotGrant>(third).size(), 0u);
  EXPECT_EQ(got<PilotGrant>(honest).size(), 1u);
}

TEST_F(OneIdentityTest, ALateTileIsCopiedWhateverThreadsAreClaimed) {
  const JobId job = submit_unaudited("r1", 0, {0, 0, 128, 64});
  const SessionId liar = join("liar", "a", 1, 4096);
  const SessionId honest = join("honest", "b");
  beat({liar, honest}, std::chrono::seconds(10));
  for (int i = 0; i < 2; ++i) {
    answer(honest);
    beat({liar, honest}, std::chrono::seconds(1));
  }
  EXPECT_EQ(status(job).state, JobState::done);
}

TEST_F(OneIdentityTest, CannotHideALateTileBehindRepeatedResults) {
  const JobId job = submit_unaudited("r1", 0, {0, 0, 128, 64});
  const SessionId liar = join("liar", "a", 1, 2);
  const LeaseGrant grant = got<LeaseGrant>(liar).at(0);
  ASSERT_EQ(grant.unit.tiles.size(), 2u);
  const WorkerResult first = result(grant, grant.unit.tiles[0], 1e-5);
  say(liar, first);
  const SessionId honest = join("honest", "b");
  for (int i = 0; i < 100; ++i) {
    pass(std::chrono::milliseconds(100));
    say(liar, first);
    say(liar, WorkerHeartbeat{leases_of(liar)});
    say(honest, WorkerHeartbeat{leases_of(honest)});
  }
  answer(honest);
  EXPECT_EQ(status(job).state, JobState::done);
}

TEST_F(OneIdentityTest, OverdueWorkGoesToAnotherIdentityNotToItsOtherNames) {
  limits.leases_per_worker = 1;
  restart({});
  const JobId job = submit_unaudited("job");
  const SessionId liar = join("liar", "a");
  beat({liar}, limits.result_timeout() - std::chrono::seconds(10));
  submit_unaudited("other", 0, {0, 0, 128, 64});
  const SessionId honest = join("honest", "z"), again = join("liar", "a2");
  ASSERT_EQ(waiting(honest) + waiting(again), 2u) << "both are busy";
  beat({honest, liar, again}, std::chrono::seconds(12));
  ASSERT_EQ(status(job).counters.leases_lost, 1u);
  answer_one(again);
  EXPECT_EQ(waiting(again), 0u);
  answer(honest);
  EXPECT_EQ(status(job).state, JobState::done);
}

TEST_F(OneIdentityTest, CannotGiveBackATileForever) {
  const JobId job = submit_unaudited("r1");
  std::vector<SessionId> liars{join("liar", "a"), join("liar", "a2")};
  const SessionId honest = join("honest", "b");
  for (int i = 0; i < 10; ++i) {
    for (const SessionId liar : liars) {
      if (const std::vector<LeaseId> leases = leases_of(liar); !leases.empty()) {
        say(liar, WorkerReturn{leases.back()});
      }
    }
  }
  ASSERT_EQ(waiting(honest), 1u);
  answer(honest);
  EXPECT_EQ(status(job).state, JobState::done);
}

TEST_F(OneIdentityTest, CannotKeepATileByGivingItBackWhileOthersAreBusy) {
  const JobId other = submit_unaudited("other work", 0, {0, 0, 64 * 100, 64});
  const SessionId honest = join("honest", "b");
  JobSpec small = spec("r1", 1, {0, 0, 64, 64});
  small.audit_share = 0;
  small.priority = 1;
  const JobId job = submit(small);
  const SessionId liar = join("liar", "a");
  say(liar, WorkerRefusal{other, "too large", true});
  const auto grants = [&] {
    return std::ranges::count_if(got<LeaseGrant>(liar), [&](const LeaseGrant& grant) { return grant.unit.job == job; });
  };
  ASSERT_EQ(grants(), 1);
  for (int i = 0; i < 2; ++i) {
    for (int half = 0; half < 2; ++half) {
      beat({honest, liar}, limits.result_timeout() * 2 / 5);
      answer_one(honest);
    }
    ASSERT_EQ(status(other).state, JobState::running);
    for (const LeaseGrant& grant : got<LeaseGrant>(liar)) {
      if (grant.unit.job == job) {
        say(liar, WorkerReturn{grant.lease});
      }
    }
    EXPECT_EQ(grants(), 2) << "the second time, others get it first";
  }
  answer(honest);
  EXPECT_EQ(status(job).state, JobState::done);
}

TEST_F(OneIdentityTest, CannotLoseAnAuditForever) {
  const JobId job = submit_audited();
  const SessionId liar = join("liar", "a"), honest = join("honest", "c");
  answer(liar, 1);
  // Without a third identity the audit would be over.
  coordinator->worker_disconnected(honest, now, effects);
  pass(limits.disconnect_grace + std::chrono::seconds(1));
  const SessionId accomplice = restart_worker(join("friend", "!"), "friend", "!", 20);
  EXPECT_EQ(status(job).state, JobState::running) << status(job).reason;
  const SessionId back = join("honest", "c");
  ASSERT_EQ(waiting(back), 1u);
  answer(back);
  const SessionId third = join("third", "d");
  answer(third);
  EXPECT_NE(worker("a").quarantine, "");
  for (int i = 0; i < 2; ++i) {
    for (const SessionId session : {accomplice, back, third}) {
      answer(session);
    }
  }
  EXPECT_EQ(status(job).state, JobState::done);
  EXPECT_EQ(sums_of(*coordinator->film(job), TileId{0})[0], 1.0f);
}

TEST_F(OneIdentityTest, LeavesAResultUnauditedByLosingTheOnlyAudit) {
  const JobId job = submit_audited();
  const SessionId first = join("first", "a"), second = join("second", "b");
  answer(first);
  const SessionId last = restart_worker(second, "second", "b", static_cast<int>(PendingAudits::kMaxLost) - 1);
  EXPECT_EQ(status(job).state, JobState::running);
  restart_worker(last, "second", "b", 1);
  EXPECT_EQ(status(job).state, JobState::done) << "there is no other identity";
  EXPECT_EQ(status(job).results_unaudited, 1u);
  EXPECT_EQ(status(job).audits_lost, 1u);
}

TEST_F(OneIdentityTest, DoesNotDelayItsJobByContradictingItself) {
  JobSpec one = spec("r1", 1);
  one.audit_share = 1e-12;
  const JobId job = submit(one);
  const SessionId only = join("only", "a", 1, 2);
  const LeaseGrant grant = got<LeaseGrant>(only).at(0);
  ASSERT_EQ(grant.unit.tiles.size(), 2u);
  WorkerResult flipped = result(grant, grant.unit.tiles[0]);
  flipped.node.values[0] += 1;
  flipped.hash = hash_of(flipped.node);
  say(only, result(grant, grant.unit.tiles[0]));
  say(only, flipped);
  say(only, result(grant, grant.unit.tiles[1]));
  EXPECT_EQ(status(job).state, JobState::done) << status(job).reason;
  EXPECT_EQ(status(job).results_unaudited, 0u) << "none was drawn";
}

TEST_F(OneIdentityTest, IsAuditedIfItContradictsItself) {
  JobSpec one = spec("r1", 1);
  one.audit_share = 1e-12;
  const JobId job = submit(one);
  const SessionId faulty = join("faulty", "a", 1, 2);
  const LeaseGrant grant = got<LeaseGrant>(faulty).at(0);
  WorkerResult flipped = result(grant, grant.unit.tiles[0]);
  flipped.node.values[0] += 1;
  flipped.hash = hash_of(flipped.node);
  say(faulty, flipped);
  say(faulty, result(grant, grant.unit.tiles[0]));
  const SessionId honest = join("honest", "b");
  ASSERT_EQ(waiting(honest), 1u);
  say(faulty, result(grant, grant.unit.tiles[1]));
  answer(honest);
  EXPECT_NE(worker("a").quarantine, "") << "one of its two results is wrong";
  EXPECT_EQ(worker("b").quarantine, "");
  answer(honest);
  EXPECT_EQ(status(job).state, JobState::done);
  EXPECT_EQ(sums_of(*coordinator->film(job), TileId{0})[0], 1.0f);
}

TEST_F(OneIdentityTest, TwoLiarsThatDifferAreFoundByTwoHonestWorkers) {
  const JobId job = submit_audited();
  const SessionId liar = join("liar", "a"), other = join("liar 2", "b"), c = join("honest", "c"),
                  d = join("honest 2", "d");
  answer(liar, 1);
  answer(other, 2);
  for (int i = 0; i < 3; ++i) {
    answer(c);
    answer(d);
  }
  EXPECT_EQ(status(job).state, JobState::done) << status(job).reason;
  EXPECT_NE(worker("a").quarantine, "");
  EXPECT_NE(worker("b").quarantine, "");
  EXPECT_EQ(sums_of(*coordinator->film(job), TileId{0})[0], 1.0f);
}

}  // namespace
}  // namespace lightmill::test
