// Jobs that workers of every fingerprint class may render.
#include "tests/unit/server/audit_fixture.h"

namespace lightmill::test {
namespace {

class MixedTest : public AuditTest {
 protected:
  SessionId connect_of(const std::string& fingerprint, const std::string& machine) {
    return connect_on(machine, "worker on " + machine, 1, fingerprint);
  }
  JobId submit_mixed(double share = 1, PixelRect crop = {0, 0, 64, 64}) {
    JobSpec job = spec("r1", 1, crop);
    job.audit_share = share;
    job.allow_mixed = true;
    return submit(job);
  }
};

TEST_F(MixedTest, WorkersOfAllClassesRenderOneJob) {
  limits.leases_per_worker = 1;
  restart({});
  const SessionId a = connect_of("class-a", "m1"), b = connect_of("class-b", "m2");
  const PixelRect two_tiles{0, 0, 128, 64};
  const JobId job = submit_mixed(0, two_tiles);
  ASSERT_EQ(waiting(a), 1u);
  ASSERT_EQ(waiting(b), 1u);
  EXPECT_EQ(status(job).fingerprint_class, kMixedClass);
  EXPECT_TRUE(status(job).spec.allow_mixed);
  EXPECT_EQ(status(job).render_digest, render_digest(spec("r1", 1, two_tiles).settings, kMixedClass));
  answer(a);
  answer(b);
  EXPECT_EQ(status(job).state, JobState::done);
}

TEST_F(MixedTest, AJobContinuesWithoutOneClass) {
  const JobId job = submit_mixed(0);
  const SessionId a = connect_of("class-a", "m1");
  ASSERT_EQ(waiting(a), 1u);
  coordinator->worker_disconnected(a, now, effects);
  pass(limits.disconnect_grace + std::chrono::seconds(1));
  EXPECT_NE(status(job).reason.find("waits for a worker"), std::string::npos);
  EXPECT_EQ(status(job).reason.find("class"), std::string::npos) << status(job).reason;
  const SessionId b = connect_of("class-b", "m2");
  answer(b);
  EXPECT_EQ(status(job).state, JobState::done);
}

TEST_F(MixedTest, AnotherRendererVersionGetsNoWork) {
  submit_mixed();
  const SessionId session{next_session++};
  coordinator->worker_connected(session, {"w", "host", 1, 1, "class-a", "another renderer", {}, false, "m1"}, now,
                                effects);
  flush();
  EXPECT_EQ(waiting(session), 0u);
}

TEST_F(MixedTest, ResultsAreAuditedByTheirOwnClass) {
  const JobId job = submit_mixed();
  const SessionId a = connect_of("class-a", "m1"), b = connect_of("class-b", "m2");
  answer(a);
  EXPECT_EQ(waiting(b), 0u);
  EXPECT_EQ(status(job).state, JobState::done) << "no connected worker can audit it";
  EXPECT_EQ(status(job).results_unaudited, 1u);

  ASSERT_TRUE(coordinator->extend(job, {.samples = 2}, now, effects).ok());
  flush();
  const SessionId c = connect_of("class-a", "m3");
  answer(c);
  EXPECT_EQ(status(job).counters.results_audited, 1u);
}

TEST_F(MixedTest, AnAuditWaitsForARecentMachineOfItsClass) {
  const JobId job = submit_mixed();
  const SessionId b = connect_of("class-b", "m2"), again = connect_of("class-a", "m3");
  coordinator->worker_disconnected(b, now, effects);
  coordinator->worker_disconnected(again, now, effects);
  pass(limits.disconnect_grace + std::chrono::seconds(1));
  const SessionId a = connect_of("class-a", "m1");
  answer(a);
  EXPECT_EQ(status(job).state, JobState::running);
  pass_with({a}, limits.auditor_timeout);
  EXPECT_EQ(status(job).state, JobState::done);
}

TEST_F(MixedTest, OtherBitsOfAnotherClassAccuseNoWorker) {
  for (const double share : {1.0, 1e-9}) {
    restart({});
    const SessionId a = connect_of("class-a", "m1"), b = connect_of("class-b", "m2"), c = connect_of("class-b", "m3"),
                    other = connect_of("class-a", "m4");
    const JobId job = submit_mixed(share, {0, 0, 256, 64});
    ASSERT_GT(waiting(a), 0u);
    const LeaseGrant grant = got<LeaseGrant>(a).at(0);
    WorkerResult copy = result(grant, grant.unit.tiles[0]);
    say(a, copy);
    copy.node.values[0] += 1;
    copy.hash = hash_of(copy.node);
    for (const auto& [session, worker] : {std::pair(b, "worker on m2"), std::pair(c, "worker on m3")}) {
      copy.tag = granted(worker, grant.lease, {job, grant.unit.range, {copy.key.tile}}, copy.render_digest).tags[0];
      say(session, copy);
    }
    for (int round = 0; round < 4; ++round) {
      for (const SessionId session : {a, b, c, other}) {
        answer(session);
      }
    }
    EXPECT_EQ(status(job).state, JobState::done) << status(job).reason;
    EXPECT_EQ(status(job).counters.nodes_dropped, 0u);
    EXPECT_EQ(status(job).counters.results_duplicate, 3 + status(job).counters.results_audited)
        << "both copies, and the repeated result of `a`";
    for (const WorkerStatus& each : coordinator->workers(now)) {
      EXPECT_EQ(each.quarantine, "") << each.name;
    }
  }
}

TEST_F(MixedTest, ADishonestWorkerIsFoundByItsClass) {
  const JobId job = submit_mixed();
  const SessionId liar = connect_of("class-a", "m1"), b = connect_of("class-b", "m2"), c = connect_of("class-a", "m3");
  answer(liar, 1);
  answer(c);
  EXPECT_NE(status(job).reason.find("another identity of class class-a"), std::string::npos) << status(job).reason;
  EXPECT_EQ(waiting(b), 0u);
  const SessionId d = connect_of("class-a", "m4");
  for (const SessionId session : {d, b, c, d, b, c}) {
    answer(session);
  }
  EXPECT_NE(worker("worker on m1").quarantine, "");
  EXPECT_EQ(worker("worker on m2").quarantine, "");
  EXPECT_EQ(status(job).state, JobState::done) << status(job).reason;
}

TEST_F(MixedTest, ARestartKeepsTheClassOfEachResult) {
  const JobId job = submit_mixed();
  const SessionId a = connect_of("class-a", "m1");
  const LeaseGrant grant = got<LeaseGrant>(a)[0];
  const WorkerResult merged = result(grant, grant.unit.tiles[0]);
  StoredState stored = stored_with(job, merged, {"worker on m1", "m1", "class-a"});
  restart(std::move(stored));
  const SessionId b = connect_of("class-b", "m2"), c = connect_of("class-a", "m3");
  pass(limits.restart_grace + std::chrono::milliseconds(1));
  EXPECT_EQ(waiting(b), 0u);
  ASSERT_EQ(waiting(c), 1u);
  answer(c);
  EXPECT_EQ(status(job).counters.results_audited, 1u);
}

TEST_F(MixedTest, NoWorkerCanHaveTheMixedClass) {
  const SessionId session = connect_of(kMixedClass, "m1");
  ASSERT_EQ(got<Dismissal>(session).size(), 1u);
  EXPECT_NE(got<Dismissal>(session)[0].reason.find("fingerprint class"), std::string::npos);
}

}  // namespace
}  // namespace lightmill::test
