// Audits: which results another machine renders again, and when the job is done.
#include "tests/unit/server/audit_fixture.h"

namespace lightmill::test {
namespace {

TEST_F(AuditTest, AResultIsRenderedAgainOnAnotherMachineBeforeTheJobIsDone) {
  const JobId job = submit_audited();
  const SessionId a = connect_on("m1", "a"), again = connect_on("m1", "a2"), b = connect_on("m2", "b");
  answer(a);
  EXPECT_EQ(status(job).state, JobState::running);
  EXPECT_EQ(waiting(again), 0u) << "two workers on one machine are one machine";
  ASSERT_EQ(waiting(b), 1u);
  EXPECT_EQ(got<LeaseGrant>(b)[0].unit, got<LeaseGrant>(a)[0].unit);
  EXPECT_EQ(status(job).results_unaudited, 1u);
  answer(b);
  EXPECT_EQ(status(job).state, JobState::done);
  EXPECT_EQ(status(job).results_unaudited, 0u);
  EXPECT_EQ(status(job).counters.results_audited, 1u);
  EXPECT_EQ(status(job).counters.results_merged, 1u);
  EXPECT_EQ(written<PutAudited>(), 1u);
}

// A worker knows the job, its digest, tiles and samples. Only the store's secret decides which results are audited.
TEST_F(AuditTest, TheDrawDependsOnTheStoresSecretAndIsTheSameAfterATakeover) {
  const auto drawn = [&](const Sha256& secret, std::uint64_t epoch) {
    sent.clear();
    writes.clear();
    worked.clear();
    StoredState stored;
    stored.epoch = epoch;
    stored.secret = secret;
    restart(std::move(stored));
    JobSpec job = spec("r1", 1, {0, 0, 512, 512});
    job.audit_share = 0.04;  // a result has 1000/64 parts, so about half are audited
    submit(job);
    const SessionId a = connect_on("m1", "a");
    answer(a);
    std::vector<bool> audited;
    for (const StoreOp& op : writes) {
      if (const auto* const put = std::get_if<PutResult>(&op)) {
        audited.push_back(put->audit_pending);
      }
    }
    EXPECT_EQ(audited.size(), 64u);
    return audited;
  };
  const std::vector<bool> first = drawn(sha256("one secret"), 1);
  EXPECT_EQ(drawn(sha256("one secret"), 7), first);
  EXPECT_NE(drawn(sha256("another secret"), 1), first);
}

TEST_F(AuditTest, AJobWithoutAnotherMachineIsDoneUnaudited) {
  const JobId job = submit_audited();
  const SessionId a = connect_on("m1", "a");
  connect_on("m1", "a2");
  answer(a);
  EXPECT_EQ(status(job).state, JobState::done);
  EXPECT_EQ(status(job).results_unaudited, 1u);
  EXPECT_EQ(status(job).counters.results_audited, 0u);
}

TEST_F(AuditTest, AnAuditWaitsForARecentMachine) {
  const JobId job = submit_audited();
  const SessionId b = connect_on("m2", "b");
  coordinator->worker_disconnected(b, now, effects);
  pass(limits.disconnect_grace + std::chrono::seconds(1));
  const SessionId a = connect_on("m1", "a");
  answer(a);
  EXPECT_EQ(status(job).state, JobState::running);
  EXPECT_EQ(status(job).reason, "waits up to 45 s for a worker of another identity, which audits 1 result");
  EXPECT_EQ(coordinator->gauges(now).waits[static_cast<std::size_t>(WaitReason::audit)], 1u);
  ASSERT_TRUE(coordinator->next_deadline());
  pass(limits.auditor_timeout / 2);
  EXPECT_EQ(status(job).state, JobState::running);
  pass(limits.auditor_timeout / 2);
  EXPECT_EQ(status(job).state, JobState::done);
}

TEST_F(AuditTest, APauseDoesNotEndTheWaitForAMachine) {
  const JobId job = submit_audited();
  const SessionId a = connect_on("m1", "a"), b = connect_on("m2", "b");
  answer(a);
  coordinator->worker_disconnected(b, now, effects);
  pass_with({a}, std::chrono::seconds(5));
  stand_still(limits.auditor_timeout * 2);
  EXPECT_EQ(status(job).state, JobState::running);
  const SessionId again = connect_on("m2", "b");
  answer(again);
  EXPECT_EQ(status(job).counters.results_audited, 1u);
}

TEST_F(AuditTest, TheWaitForASilentMachineEnds) {
  const JobId job = submit_audited();
  const SessionId b = connect_on("m2", "b"), a = connect_on("m1", "a");
  answer(b);
  ASSERT_EQ(waiting(a), 1u);
  pass_with({b}, limits.silence + std::chrono::seconds(1));
  EXPECT_EQ(closed, std::vector{a});
  EXPECT_EQ(status(job).state, JobState::running) << "it may come back";
  pass_with({b}, limits.auditor_timeout - limits.silence);
  EXPECT_EQ(status(job).state, JobState::done);
  EXPECT_EQ(status(job).results_unaudited, 1u);
}

TEST_F(AuditTest, AHoldKeepsPendingAudits) {
  const JobId job = submit_audited();
  const SessionId a = connect_on("m1", "a"), b = connect_on("m2", "b");
  coordinator->hold("waits for space", now, effects);
  flush();
  answer(a);
  pass_with({a, b}, limits.auditor_timeout * 2);
  EXPECT_EQ(waiting(b), 0u);
  EXPECT_EQ(status(job).state, JobState::running);
  EXPECT_EQ(status(job).reason, "waits for space");
  coordinator->hold("", now, effects);
  flush();
  answer(b);
  EXPECT_EQ(status(job).state, JobState::done);
  EXPECT_EQ(status(job).counters.results_audited, 1u);
}

TEST_F(AuditTest, ADeletedJobDropsItsPendingAudits) {
  limits.keep_ended = std::chrono::hours(10);
  restart({});
  const JobId job = submit_audited();
  const SessionId a = connect_on("m1", "a");
  answer(a);
  ASSERT_EQ(status(job).state, JobState::done);
  ASSERT_EQ(status(job).results_unaudited, 1u);
  coordinator->worker_disconnected(a, now, effects);
  pass(limits.keep_ended + std::chrono::minutes(2));
  EXPECT_FALSE(coordinator->status(job, now).ok());
  EXPECT_EQ(written<DeleteJobRows>(), 1u);
  const SessionId b = connect_on("m2", "b");
  const JobId next = submit_audited(0, "next");
  EXPECT_EQ(waiting(b), 1u);
  answer(b);
  EXPECT_EQ(status(next).state, JobState::done);
}

// A returning worker sends a result of a lost lease, and does not render that again.
TEST_F(AuditTest, AResultForALostLeaseEndsTheWorkersNewLease) {
  const JobId job = submit_audited();
  const SessionId liar = connect_on("m1", "liar"), before = connect_on("m2", "b");
  answer(liar, 1);
  ASSERT_EQ(waiting(before), 1u);
  const WorkerResult rendered = result(got<LeaseGrant>(before).front(), TileId{0});
  coordinator->worker_disconnected(before, now, effects);
  flush();
  pass_with({liar}, limits.disconnect_grace + std::chrono::seconds(1));
  const SessionId again = connect_on("m2", "b");
  ASSERT_EQ(waiting(again), 1u);
  ASSERT_EQ(worker("b").leases, 1u);
  say(again, rendered);
  EXPECT_EQ(worker("b").leases, 0u);
  EXPECT_EQ(status(job).state, JobState::running) << "a third is to decide";
}

TEST_F(AuditTest, NoResultIsAuditedWithoutAShare) {
  const JobId job = submit_audited(0);
  const SessionId a = connect_on("m1", "a"), b = connect_on("m2", "b");
  answer(a);
  EXPECT_EQ(waiting(b), 0u);
  EXPECT_EQ(status(job).state, JobState::done);
}

TEST_F(AuditTest, ARestartKeepsQuarantineAndPendingAudits) {
  const JobId job = submit_audited();
  const SessionId a = connect_on("m1", "a");
  (void)a;
  const WorkerResult first = result(got<LeaseGrant>(a)[0], TileId{0});
  const SessionId busy = connect_on("m2", "busy");
  (void)busy;
  say(a, first);
  ASSERT_EQ(status(job).state, JobState::running);
  StoredState stored = stored_with(job, first, {"a", "m1"});
  stored.quarantine = {{{"liar", "m9"}, "it lied", 1}};
  restart(std::move(stored));
  EXPECT_EQ(worker("liar").quarantine, "it lied");
  EXPECT_EQ(status(job).results_unaudited, 1u);
  const SessionId liar = connect_on("m9", "liar");
  const SessionId b = connect_on("m2", "b");
  pass(limits.restart_grace);
  EXPECT_EQ(waiting(liar), 0u);
  ASSERT_EQ(waiting(b), 1u);
  answer(b);
  EXPECT_EQ(status(job).state, JobState::done);
  EXPECT_EQ(status(job).counters.results_audited, 1u);
}

TEST_F(AuditTest, RecordsOfLostSamplesAreDroppedWithTheNextEffects) {
  const JobId job = submit_audited();
  const SessionId a = connect_on("m1", "a");
  const WorkerResult first = result(got<LeaseGrant>(a)[0], TileId{0});
  say(a, first);
  StoredState stored = stored_with(job, first, {"a", "m1"});
  stored.jobs[0].nodes.clear();  // damaged: the store has left it out
  restart(std::move(stored));
  writes.clear();
  pass(std::chrono::milliseconds(1));
  const auto dropped =
      std::ranges::find_if(writes, [](const StoreOp& op) { return std::holds_alternative<DropResults>(op); });
  ASSERT_NE(dropped, writes.end());
  EXPECT_EQ(std::get<DropResults>(*dropped).key, first.key);
  writes.clear();
  pass(std::chrono::milliseconds(1));
  EXPECT_EQ(written<DropResults>(), 0u) << "once";
}

TEST_F(AuditTest, ACancelledJobHasNoPendingAuditsAfterARestart) {
  const JobId job = submit_audited();
  const SessionId a = connect_on("m1", "a"), b = connect_on("m2", "b");
  const WorkerResult first = result(got<LeaseGrant>(a)[0], TileId{0});
  say(a, first);
  ASSERT_EQ(status(job).results_unaudited, 1u);
  ASSERT_TRUE(coordinator->cancel(job, now, unix_ms(), effects).ok());
  flush();
  EXPECT_EQ(got<LeaseCancel>(b).size(), 1u);
  EXPECT_EQ(status(job).results_unaudited, 0u);
  restart(stored_with(job, first, {"a", "m1"}));
  EXPECT_EQ(status(job).state, JobState::cancelled);
  EXPECT_EQ(status(job).results_unaudited, 0u);
}

}  // namespace
}  // namespace lightmill::test
