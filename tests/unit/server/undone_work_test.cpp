// Work of a worker that is in quarantine is dropped and rendered again.
#include "tests/support/film_planes.h"
#include "tests/unit/server/audit_fixture.h"

namespace lightmill::test {
namespace {

using QuarantineTest = AuditTest;

TEST_F(QuarantineTest, AThirdMachineDecidesAndTheLiarsWorkIsUndone) {
  const JobId job = submit_audited();
  const SessionId liar = connect_on("m1", "liar"), b = connect_on("m2", "b");
  answer(liar, 1);
  answer(b);
  EXPECT_EQ(status(job).state, JobState::running);
  EXPECT_NE(status(job).reason.find("differ between liar (m1) and b (m2)"), std::string::npos) << status(job).reason;
  pass_with({liar, b}, limits.auditor_timeout * 2);
  EXPECT_EQ(status(job).state, JobState::running) << "it waits for a third machine";
  const SessionId c = connect_on("m3", "c");
  EXPECT_EQ(status(job).reason, "");
  ASSERT_EQ(waiting(c), 1u);
  answer(c);
  EXPECT_EQ(worker("liar").quarantine,
            "its samples [0, 1) of the 64x64 pixels at 0, 0 of job 1 differ from those of b (m2) and c (m3), "
            "which agree");
  EXPECT_EQ(worker("b").quarantine, "");
  EXPECT_EQ(got<Notice>(liar).size(), 1u);
  EXPECT_EQ(written<PutQuarantine>(), 1u);
  EXPECT_EQ(written<DropResults>(), 1u);
  EXPECT_EQ(status(job).counters.nodes_dropped, 1u);
  EXPECT_EQ(waiting(liar), 0u);
  for (int i = 0; i < 3; ++i) {
    answer(b);
    answer(c);
  }
  EXPECT_EQ(status(job).state, JobState::done);
  EXPECT_EQ(status(job).results_unaudited, 0u);
  EXPECT_EQ(sums_of(*coordinator->film(job), TileId{0})[0], 1.0f) << "the result of the honest machines";
}

// A worker does not render what it holds a result of. It waits for the acknowledgement.
TEST_F(QuarantineTest, DroppedWorkIsGrantedAgainAfterItsAcknowledgement) {
  const JobId job = submit_audited();
  const SessionId liar = connect_on("m1", "liar"), b = connect_on("m2", "b"), c = connect_on("m3", "c");
  answer(liar, 1);
  answer(b);
  ASSERT_EQ(waiting(c), 1u);
  const LeaseGrant audit = got<LeaseGrant>(c).back();
  coordinator->worker_message(c, result(audit, TileId{0}), now, unix_ms(), effects);
  EXPECT_TRUE(leases_granted(effects.now).empty());
  std::vector<std::string> order;  // of messages to c
  for (const Outgoing& message : effects.after_commit) {
    if (message.to == c && std::holds_alternative<ResultAck>(message.message)) {
      order.emplace_back("acknowledgement");
    } else if (message.to == c && std::holds_alternative<LeaseGrant>(message.message)) {
      EXPECT_EQ(std::get<LeaseGrant>(message.message).unit, audit.unit);
      order.emplace_back("grant");
    }
  }
  EXPECT_EQ(order, (std::vector<std::string>{"acknowledgement", "grant"}));
  flush();
  answer(b);
  answer(c);
  answer(b);
  answer(c);
  EXPECT_EQ(status(job).state, JobState::done);
}

TEST_F(QuarantineTest, AQuarantinedWorkersResultIsGrantedAgainAfterItsAcknowledgement) {
  submit(spec("r1", 2, {0, 0, 64, 64}));
  const SessionId worker = connect_on("m1", "worker");
  ASSERT_EQ(waiting(worker), 2u);
  answer_one(worker);
  const LeaseGrant grant = got<LeaseGrant>(worker).back();
  ASSERT_TRUE(coordinator->quarantine_worker("worker", std::string(kByHand) + "hand", false, now, effects).ok());
  flush();
  Effects not_stored_yet;
  coordinator->worker_message(worker, result(grant, TileId{0}), now, unix_ms(), not_stored_yet);
  ASSERT_TRUE(coordinator->release_worker("worker", now, effects).ok());
  EXPECT_TRUE(leases_granted(effects.now).empty());
  EXPECT_EQ(leases_granted(effects.after_commit).size(), 1u);
}

TEST_F(QuarantineTest, ADepartedWorkersResultsCanBeRenderedAgain) {
  JobSpec job = spec("r1", 8, {0, 0, 64, 64});
  job.audit_share = 0;
  const JobId id = submit(job);
  const SessionId gone = connect_on("m1", "gone");
  while (waiting(gone) > 0) {
    answer(gone);
  }
  ASSERT_EQ(status(id).state, JobState::done);
  coordinator->worker_disconnected(gone, now, effects);
  flush();
  pass(std::chrono::minutes(10));
  ASSERT_TRUE(coordinator->quarantine_worker("gone", "put there by hand", true, now, effects).ok());
  flush();
  EXPECT_EQ(status(id).state, JobState::running);
  EXPECT_GT(status(id).counters.nodes_dropped, 0u);
}

TEST_F(QuarantineTest, AJobWhoseTimeIsUpEndsWithTheLiarsLastLease) {
  const JobId disputed = submit_audited();
  const SessionId liar = connect_on("m1", "liar"), b = connect_on("m2", "b");
  answer(liar, 1);
  answer(b);
  coordinator->worker_disconnected(b, now, effects);
  JobSpec job = spec("timed", 0, {0, 0, 64, 64});
  job.goal.seconds = 3;
  job.audit_share = 0;
  const JobId timed = submit(job);
  answer_one(liar);
  ASSERT_GT(waiting(liar), 0u);
  pass_with({liar}, std::chrono::seconds(5));
  EXPECT_EQ(status(timed).state, JobState::running) << "its last samples are still to come";
  const SessionId c = connect_on("m3", "c");
  answer(c);
  ASSERT_NE(worker("liar").quarantine, "");
  EXPECT_EQ(waiting(c), 0u);
  pass_with({c}, std::chrono::seconds(1));
  EXPECT_EQ(status(timed).state, JobState::done) << status(timed).reason;
  (void)disputed;
}

TEST_F(QuarantineTest, ADoneJobWithWrongResultsResumes) {
  const JobId first = submit_audited(0, "first");
  const SessionId liar = connect_on("m1", "liar");
  answer(liar, 1);
  ASSERT_EQ(status(first).state, JobState::done);
  const JobId second = submit_audited(1, "second");
  const SessionId b = connect_on("m2", "b"), c = connect_on("m3", "c");
  answer(liar, 1);
  answer(b);
  answer(c);
  EXPECT_EQ(status(first).counters.nodes_dropped, 1u);
  for (int i = 0; i < 3; ++i) {
    answer(b);
    answer(c);
  }
  EXPECT_EQ(status(first).state, JobState::done);
  EXPECT_EQ(status(second).state, JobState::done);
  EXPECT_EQ(sums_of(*coordinator->film(first), TileId{0})[0], 1.0f);
}

TEST_F(QuarantineTest, SecondsOfDroppedResultsAreUsedAgain) {
  JobSpec timed = spec("first", 0, {0, 0, 64, 64});
  timed.goal.seconds = 5;
  timed.audit_share = 0;
  const JobId first = submit(timed);
  const SessionId b = connect_on("m2", "b");
  const LeaseGrant honest = got<LeaseGrant>(b).at(0);
  say(b, result(honest, TileId{0}));
  coordinator->worker_disconnected(b, now, effects);
  const SessionId liar = connect_on("m1", "liar");
  pass_with({liar}, std::chrono::seconds(6));  // its seconds are over, and it has what b held
  answer(liar, 1);
  ASSERT_EQ(status(first).state, JobState::done);
  ASSERT_GE(status(first).active_seconds, 5);
  submit_audited(1, "second");
  const SessionId c = connect_on("m3", "c"), d = connect_on("m4", "d");
  answer(liar, 1);
  while (worker("liar").quarantine.empty()) {
    answer_one(c);
    answer_one(d);
  }
  EXPECT_EQ(status(first).state, JobState::running);
  EXPECT_EQ(status(first).active_seconds, 0) << "all was joined";
  for (int second = 0; second < 6; ++second) {
    pass_with({c, d}, std::chrono::seconds(1));
    answer_one(c);
    answer_one(d);
  }
  answer(c);
  answer(d);
  EXPECT_EQ(status(first).state, JobState::done);
  EXPECT_GE(status(first).active_seconds, 5);
  EXPECT_GT(status(first).frame_samples, honest.unit.range.end());
}

TEST_F(QuarantineTest, ATimedJobUnderAuditResumesWhenSamplesAreDropped) {
  JobSpec timed = spec("timed", 0, {0, 0, 64, 64});
  timed.goal.seconds = 5;
  timed.audit_share = 1;
  const JobId id = submit(timed);
  const SessionId liar = connect_on("m1", "liar"), c = connect_on("m2", "c"), d = connect_on("m3", "d");
  pass_with({liar, c, d}, std::chrono::seconds(6));
  answer_one(liar, 1);
  ASSERT_EQ(status(id).state, JobState::running) << "the liar's results still wait for audits";
  while (worker("liar").quarantine.empty()) {
    ASSERT_GT(waiting(c) + waiting(d), 0u);
    answer_one(c);
    answer_one(d);
  }
  EXPECT_EQ(status(id).state, JobState::running);
  EXPECT_LT(status(id).active_seconds, 5);
  for (int second = 0; second < 7; ++second) {
    pass_with({c, d}, std::chrono::seconds(1));
    answer_one(c);
    answer_one(d);
  }
  answer(c);
  answer(d);
  EXPECT_EQ(status(id).state, JobState::done);
  EXPECT_GE(status(id).active_seconds, 5);
}

TEST_F(QuarantineTest, AQuarantinedDepartedWorkerIsForgottenWithItsLeases) {
  limits.max_workers = 3;
  limits.disconnect_grace = std::chrono::hours(1);
  limits.lease_duration = std::chrono::hours(1);
  restart({});
  submit_audited(1, "r1", {0, 0, 256, 64});
  const SessionId liar = connect_on("m1", "liar"), b = connect_on("m2", "b");
  const LeaseGrant lied = got<LeaseGrant>(liar).at(0);
  ASSERT_GE(lied.unit.tiles.size(), 2u) << "it still holds the lease when it goes";
  WorkerResult wrong = result(lied, lied.unit.tiles[0]);
  wrong.node.values[0] += 1;
  wrong.hash = hash_of(wrong.node);
  say(liar, wrong);
  coordinator->worker_disconnected(liar, now, effects);
  flush();
  const SessionId c = connect_on("m3", "c");
  for (int i = 0; i < 6; ++i) {
    answer(b);
    answer(c);
  }
  ASSERT_NE(worker("liar").quarantine, "");
  connect_on("m4", "d");
  EXPECT_TRUE(worker("d").connected && worker("d").host == "host of m4") << "there is room for three";
}

TEST_F(QuarantineTest, ResultsOfAQuarantinedWorkerDoNotCount) {
  const JobId job = submit_audited(1, "r1", {0, 0, 128, 64});
  const SessionId liar = connect_on("m1", "liar"), b = connect_on("m2", "b"), c = connect_on("m3", "c");
  ASSERT_GE(waiting(liar), 1u);
  const LeaseGrant grant = got<LeaseGrant>(liar)[0];
  WorkerResult wrong = result(grant, grant.unit.tiles[0]);
  wrong.node.values[0] += 1;
  wrong.hash = hash_of(wrong.node);
  say(liar, wrong);
  for (int i = 0; i < 4; ++i) {
    answer(b);
    answer(c);
  }
  ASSERT_NE(worker("liar").quarantine, "");
  const std::uint64_t merged = status(job).counters.results_merged;
  const std::size_t acknowledged = got<ResultAck>(liar).size();
  say(liar, wrong);
  EXPECT_EQ(status(job).counters.results_merged, merged);
  EXPECT_EQ(got<ResultAck>(liar).size(), acknowledged + 1) << "it may forget them";
}

}  // namespace
}  // namespace lightmill::test
