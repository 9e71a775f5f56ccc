// Workers in quarantine: who is excluded, for what reason, and until when.
#include "tests/support/film_planes.h"
#include "tests/unit/server/audit_fixture.h"

namespace lightmill::test {
namespace {

using QuarantineTest = AuditTest;

TEST_F(QuarantineTest, WorkersOfOneCertificateDoNotAuditEachOther) {
  const JobId job = submit_audited();
  const SessionId one = connect_with("shared", "a", "m1", "h1"), two = connect_with("shared", "b", "m2", "h2");
  answer(one, 1);
  answer(two, 1);
  EXPECT_EQ(status(job).state, JobState::done) << "it does not wait for an auditor";
  EXPECT_TRUE(status(job).one_identity);
  EXPECT_EQ(status(job).results_unaudited, 1u);
  EXPECT_EQ(status(job).counters.results_audited, 0u);
}

TEST_F(QuarantineTest, AQuarantineHoldsForAllNamesOfAnIdentity) {
  submit_audited();
  const SessionId liar = connect_with("liar", "a", "m1", "h1"), b = connect_with("b", "b", "m2", "h2"),
                  c = connect_with("c", "c", "m3", "h3");
  answer(liar, 1);
  answer(b);
  answer(c);
  EXPECT_NE(worker("liar/a").quarantine, "");
  coordinator->worker_disconnected(liar, now, effects);
  flush();
  const SessionId again = connect_with("liar", "another name", "another machine", "another host");
  EXPECT_NE(worker("liar/another name").quarantine, "");
  submit_audited(1, "r2");
  EXPECT_EQ(waiting(again), 0u);
  EXPECT_EQ(got<Notice>(again).size(), 1u);
}

TEST_F(QuarantineTest, AFalseMachineOrHostHarmsNoOtherWorker) {
  submit_audited();
  // It claims b's machine and host.
  const SessionId liar = connect_with("liar", "a", "m2", "h2"), b = connect_with("b", "b", "m2", "h2"),
                  c = connect_with("c", "c", "m3", "h3");
  answer(liar, 1);
  answer(b);
  answer(c);
  EXPECT_NE(worker("liar/a").quarantine, "");
  EXPECT_EQ(worker("b/b").quarantine, "");
}

TEST_F(QuarantineTest, ARestartedMachineIsRecognizedByItsHost) {
  submit_audited();
  const SessionId liar = connect_on("m1", "liar"), b = connect_on("m2", "b"), c = connect_on("m3", "c");
  answer(liar, 1);
  answer(b);
  answer(c);
  ASSERT_NE(worker("liar").quarantine, "");
  coordinator->worker_disconnected(liar, now, effects);
  flush();
  connect_as({"new name", "host of m1", 1, 1, "class-a", kRendererVersion, {}, false, "m1 of another day"});
  EXPECT_NE(worker("new name").quarantine, "");
  ASSERT_TRUE(coordinator->release_worker("new name", now, effects).ok());
  flush();
  EXPECT_EQ(worker("new name").quarantine, "");
}

TEST_F(QuarantineTest, AManualQuarantineStopsAWorkerAndItsMachineUntilRelease) {
  JobSpec job = spec("r1", 8, {0, 0, 64, 64});
  job.audit_share = 0;
  const JobId id = submit(job);
  const SessionId suspect = connect_on("m1", "suspect"), beside = connect_on("m1", "beside");
  answer_one(suspect);
  ASSERT_GT(waiting(suspect) + waiting(beside), 0u);
  EXPECT_EQ(coordinator->quarantine_worker("unknown", "by hand", false, now, effects).code(), StatusCode::kNotFound);
  ASSERT_TRUE(coordinator->quarantine_worker("suspect", "put there by ada: smoke", false, now, effects).ok());
  flush();
  EXPECT_EQ(worker("suspect").quarantine, "put there by ada: smoke");
  EXPECT_NE(worker("beside").quarantine.find("in common with suspect"), std::string::npos);
  EXPECT_EQ(written<PutQuarantine>(), 1u);
  EXPECT_EQ(status(id).counters.nodes_dropped, 0u) << "its results stay";
  pass_with({suspect, beside}, std::chrono::seconds(2));
  const SessionId other = connect_on("m2", "other");
  while (waiting(other) > 0) {
    answer(other);
  }
  EXPECT_EQ(status(id).state, JobState::done);

  // Later its work turns out to be untrustworthy.
  ASSERT_TRUE(coordinator->quarantine_worker("suspect", "put there by ada: again", true, now, effects).ok());
  flush();
  EXPECT_EQ(worker("suspect").quarantine, "put there by ada: again");
  EXPECT_GT(status(id).counters.nodes_dropped, 0u);
  EXPECT_EQ(status(id).state, JobState::running);
  while (waiting(other) > 0) {
    answer(other);
  }
  EXPECT_EQ(status(id).state, JobState::done);
  ASSERT_TRUE(coordinator->release_worker("beside", now, effects).ok());
  flush();
  EXPECT_EQ(worker("suspect").quarantine, "");
}

TEST_F(QuarantineTest, AnIdentityIsQuarantinedAndReleasedByItsName) {
  JobSpec job = spec("r1", 8, {0, 0, 64, 64});
  job.audit_share = 0;
  const JobId id = submit(job);
  const SessionId a = connect_with("render-3", "a", "m1", "h1");
  answer_one(a);
  connect_with("render-4", "a", "m2", "h2");
  ASSERT_TRUE(coordinator->quarantine_worker("render-3", "put there by ada: smoke", true, now, effects).ok());
  flush();
  EXPECT_EQ(worker("render-3/a").quarantine, "put there by ada: smoke");
  EXPECT_EQ(worker("render-4/a").quarantine, "");
  EXPECT_GT(status(id).counters.nodes_dropped, 0u) << "also results of its workers";
  ASSERT_TRUE(coordinator->release_worker("render-3", now, effects).ok());
  flush();
  EXPECT_EQ(worker("render-3/a").quarantine, "");

  coordinator->worker_disconnected(a, now, effects);
  flush();
  ASSERT_TRUE(coordinator->quarantine_worker("render-3/a", "put there by ada: gone", false, now, effects).ok());
  flush();
  connect_with("render-3", "another", "m1", "h1");
  EXPECT_NE(worker("render-3/another").quarantine, "");
  ASSERT_TRUE(coordinator->release_worker("render-3", now, effects).ok())
      << "it ends a quarantine that began with another worker of it";
  flush();
  EXPECT_EQ(worker("render-3/another").quarantine, "");
  const Status unknown = coordinator->quarantine_worker("render-7", "put there by ada", false, now, effects);
  EXPECT_EQ(unknown.code(), StatusCode::kNotFound);
  EXPECT_NE(message_of(unknown).find("has never connected"), std::string::npos);
}

TEST_F(QuarantineTest, AJobWithoutOtherWorkersNamesTheQuarantinedOnesAndTheRemedy) {
  const JobId job = submit_audited(0);
  const SessionId first = connect_on("m1", "first"), beside = connect_on("m1", "beside");
  const SessionId other = connect_on("m2", "other", 1, "class-b");
  pass_with({first, beside, other}, std::chrono::seconds(1));
  ASSERT_EQ(status(job).fingerprint_class, "class-a");
  ASSERT_TRUE(coordinator->quarantine_worker("first", "put there by ada: smoke", false, now, effects).ok());
  flush();
  EXPECT_EQ(
      status(job).reason,
      "waits for a worker: beside and 1 more are in quarantine. End the quarantine with `lightmill workers release beside`");
  coordinator->worker_disconnected(beside, now, effects);
  flush();
  EXPECT_EQ(status(job).reason,
            "waits for a worker: first is in quarantine. End the quarantine with `lightmill workers release first`");
  coordinator->worker_disconnected(first, now, effects);
  flush();
  EXPECT_EQ(status(job).reason,
            fmt::format("waits for a worker with renderer {} and fingerprint class class-a: other is of class class-b",
                        kRendererVersion))
      << "a disconnected worker renders nothing, released or not";
  const SessionId again = connect_on("m1", "first", 2);
  EXPECT_EQ(waiting(again), 0u);
  ASSERT_TRUE(coordinator->release_worker("first", now, effects).ok());
  flush();
  EXPECT_EQ(status(job).reason, "");
  EXPECT_GT(waiting(again), 0u) << "the stated remedy helps";
}

TEST_F(QuarantineTest, AManualReasonCanBeReplaced) {
  connect_on("m1", "w1");
  ASSERT_TRUE(coordinator->quarantine_worker("w1", "put there by ada", false, now, effects).ok());
  ASSERT_TRUE(coordinator->quarantine_worker("w1", "put there by ada: bad memory", false, now, effects).ok());
  flush();
  EXPECT_EQ(worker("w1").quarantine, "put there by ada: bad memory");
  ASSERT_TRUE(coordinator->quarantine_worker("w1", "put there by bob", false, now, effects).ok());
  flush();
  EXPECT_EQ(worker("w1").quarantine, "put there by ada: bad memory") << "bob said nothing";
}

TEST_F(QuarantineTest, AnAuditsReasonReplacesAManualOne) {
  submit_audited();
  const SessionId liar = connect_on("m1", "liar"), b = connect_on("m2", "b");
  answer(liar, 1);
  answer(b);
  ASSERT_TRUE(coordinator->quarantine_worker("liar", "put there by ada: a reboot", false, now, effects).ok());
  flush();
  const SessionId c = connect_on("m3", "c");
  answer(c);
  EXPECT_NE(worker("liar").quarantine.find("which agree"), std::string::npos) << worker("liar").quarantine;
  EXPECT_EQ(written<PutQuarantine>(), 2u);
  ASSERT_TRUE(coordinator->quarantine_worker("liar", "put there by ada", false, now, effects).ok());
  flush();
  EXPECT_NE(worker("liar").quarantine.find("which agree"), std::string::npos)
      << "a manual quarantine does not replace that of an audit";
}

TEST_F(QuarantineTest, ManualQuarantinesHaveTheirOwnReasonsAndRecords) {
  const SessionId first = connect_on("m1", "a");
  connect_on("m1", "b");
  ASSERT_TRUE(coordinator->quarantine_worker("a", "put there by ada: smoke", false, now, effects).ok());
  ASSERT_TRUE(coordinator->quarantine_worker("b", "put there by ada: noise", false, now, effects).ok());
  flush();
  EXPECT_EQ(written<PutQuarantine>(), 2u);
  EXPECT_EQ(worker("b").quarantine, "put there by ada: noise");
  // Another machine has this name. Quarantine now means that one, and the first machine's other workers continue.
  coordinator->worker_disconnected(first, now, effects);
  connect_on("m2", "a");
  connect_on("m2", "c");
  ASSERT_TRUE(coordinator->release_worker("b", now, effects).ok());
  flush();
  EXPECT_EQ(worker("c").quarantine, "");
  ASSERT_TRUE(coordinator->quarantine_worker("a", "put there by ada: again", false, now, effects).ok());
  flush();
  EXPECT_NE(worker("c").quarantine, "");
  EXPECT_EQ(worker("b").quarantine, "");
}

TEST_F(QuarantineTest, ADisconnectedWorkerIsReleasedWithItsMachine) {
  const SessionId a = connect_on("m1", "a");
  connect_on("m1", "b");
  for (const char* const name : {"a", "b"}) {
    ASSERT_TRUE(coordinator->quarantine_worker(name, "put there by ada", false, now, effects).ok());
  }
  coordinator->worker_disconnected(a, now, effects);
  flush();
  ASSERT_TRUE(coordinator->release_worker("a", now, effects).ok());
  flush();
  EXPECT_EQ(worker("b").quarantine, "");
  connect_on("m1", "a", 2);
  EXPECT_EQ(worker("a").quarantine, "");
}

TEST_F(QuarantineTest, AnAuditorThatWronglyDisagreesEntersQuarantine) {
  const JobId job = submit_audited();
  const SessionId a = connect_on("m1", "a"), liar = connect_on("m2", "liar");
  answer(a);
  answer(liar, 1);
  const SessionId c = connect_on("m3", "c");
  answer(c);
  EXPECT_NE(worker("liar").quarantine, "");
  EXPECT_EQ(worker("a").quarantine, "");
  EXPECT_EQ(status(job).state, JobState::done);
  EXPECT_EQ(status(job).counters.nodes_dropped, 0u);
}

TEST_F(QuarantineTest, ThreeDifferentResultsAccuseOnlyTheProgram) {
  const JobId job = submit_audited();
  const SessionId a = connect_on("m1", "a"), b = connect_on("m2", "b"), c = connect_on("m3", "c");
  answer(a, 1);
  answer(b, 2);
  answer(c, 3);
  EXPECT_EQ(status(job).state, JobState::paused);
  EXPECT_NE(status(job).reason.find("have 3 different results, from a (m1) and b (m2) and c (m3)"), std::string::npos)
      << status(job).reason;
  EXPECT_EQ(written<PutQuarantine>(), 0u);
  ASSERT_TRUE(coordinator->resume(job, now, effects).ok());
  flush();
  EXPECT_EQ(status(job).reason, "");
  for (int i = 0; i < 2; ++i) {
    answer(a);
    answer(b);
    answer(c);
  }
  EXPECT_EQ(status(job).state, JobState::done);
}

TEST_F(QuarantineTest, QuarantineCoversTheMachineUntilRelease) {
  const JobId job = submit_audited();
  const SessionId liar = connect_on("m1", "liar"), b = connect_on("m2", "b"), c = connect_on("m3", "c");
  answer(liar, 1);
  answer(b);
  answer(c);
  ASSERT_NE(worker("liar").quarantine, "");
  const SessionId other_name = connect_on("m1", "liar2");
  EXPECT_NE(worker("liar2").quarantine.find("it has the identity m1 in common with liar"), std::string::npos);
  for (int i = 0; i < 3; ++i) {
    answer(b);
    answer(c);
  }
  ASSERT_EQ(status(job).state, JobState::done);
  coordinator->worker_disconnected(liar, now, effects);
  flush();
  EXPECT_FALSE(worker("liar").connected) << "still listed";
  const JobId next = submit_audited(0, "next");
  EXPECT_EQ(waiting(other_name), 0u);
  EXPECT_EQ(coordinator->release_worker("b", now, effects).code(), StatusCode::kNotFound);
  ASSERT_TRUE(coordinator->release_worker("liar", now, effects).ok());
  flush();
  EXPECT_EQ(written<DropQuarantine>(), 1u);
  EXPECT_EQ(worker("liar2").quarantine, "");
  answer(b);
  answer(c);
  EXPECT_EQ(status(next).state, JobState::done);
  submit_audited(0, "last", {0, 0, 256, 64});
  EXPECT_EQ(waiting(other_name), 1u);
}

}  // namespace
}  // namespace lightmill::test
