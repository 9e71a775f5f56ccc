// Liars and bad machines: how a coordinator treats results that differ.
#include "tests/support/film_planes.h"
#include "tests/unit/server/verifying_fixture.h"

namespace lightmill::test {
namespace {

using QuarantineTest = VerifyingTest;

TEST_F(QuarantineTest, AThirdMachineDecidesAndTheLiarsWorkIsUndone) {
  const JobId job = submit_verified();
  const SessionId liar = connect_on("m1", "liar"), b = connect_on("m2", "b");
  answer(liar, 1);
  answer(b);
  EXPECT_EQ(status(job).state, JobState::running);
  EXPECT_NE(status(job).reason.find("differ between liar (m1) and b (m2)"), std::string::npos) << status(job).reason;
  pass_with({liar, b}, limits.auditor_patience * 2);
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
  EXPECT_EQ(status(job).results_unverified, 0u);
  EXPECT_EQ(sums_of(*coordinator->film(job), TileId{0})[0], 1.0f) << "the result of the honest machines";
}

// A worker does not render what it holds a result of. It waits for the acknowledgement.
TEST_F(QuarantineTest, DroppedWorkIsGrantedAgainAfterItsAcknowledgement) {
  const JobId job = submit_verified();
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

TEST_F(QuarantineTest, WorkersOfOneCertificateDoNotAuditEachOther) {
  const JobId job = submit_verified();
  const SessionId one = connect_with("shared", "a", "m1", "h1"), two = connect_with("shared", "b", "m2", "h2");
  answer(one, 1);
  answer(two, 1);
  EXPECT_EQ(status(job).state, JobState::done) << "it does not wait for an auditor";
  EXPECT_TRUE(status(job).one_identity);
  EXPECT_EQ(status(job).results_unverified, 1u);
  EXPECT_EQ(status(job).counters.results_verified, 0u);
}

TEST_F(QuarantineTest, AConvictedIdentityStaysOutUnderAnyName) {
  submit_verified();
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
  submit_verified(1, "r2");
  EXPECT_EQ(waiting(again), 0u);
  EXPECT_EQ(got<Notice>(again).size(), 1u);
}

TEST_F(QuarantineTest, AFalseMachineOrHostHarmsNoOtherWorker) {
  submit_verified();
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
  submit_verified();
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
  job.verify_share = 0;
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
  EXPECT_EQ(worker("suspect").quarantine, "put there by ada: smoke") << "for its own reason";
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
  job.verify_share = 0;
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
  const JobId job = submit_verified(0);
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

TEST_F(QuarantineTest, AConvictionReplacesAManualReason) {
  submit_verified();
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
      << "a manual quarantine does not replace a conviction";
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

TEST_F(QuarantineTest, ADepartedWorkersResultsCanBeRenderedAgain) {
  JobSpec job = spec("r1", 8, {0, 0, 64, 64});
  job.verify_share = 0;
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
  const JobId disputed = submit_verified();
  const SessionId liar = connect_on("m1", "liar"), b = connect_on("m2", "b");
  answer(liar, 1);
  answer(b);
  coordinator->worker_disconnected(b, now, effects);
  JobSpec job = spec("timed", 0, {0, 0, 64, 64});
  job.goal.seconds = 3;
  job.verify_share = 0;
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

TEST_F(QuarantineTest, AnAuditorThatWronglyDisagreesIsTheLiar) {
  const JobId job = submit_verified();
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
  const JobId job = submit_verified();
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

TEST_F(QuarantineTest, ADoneJobWithResultsOfALiarResumes) {
  const JobId first = submit_verified(0, "first");
  const SessionId liar = connect_on("m1", "liar");
  answer(liar, 1);
  ASSERT_EQ(status(first).state, JobState::done);
  const JobId second = submit_verified(1, "second");
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
  timed.verify_share = 0;
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
  submit_verified(1, "second");
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
  timed.verify_share = 1;
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

TEST_F(QuarantineTest, QuarantineCoversTheMachineUntilRelease) {
  const JobId job = submit_verified();
  const SessionId liar = connect_on("m1", "liar"), b = connect_on("m2", "b"), c = connect_on("m3", "c");
  answer(liar, 1);
  answer(b);
  answer(c);
  ASSERT_NE(worker("liar").quarantine, "");
  const SessionId other_name = connect_on("m1", "liar2");
  EXPECT_NE(worker("liar2").quarantine.find("it has m1 in common with liar"), std::string::npos);
  for (int i = 0; i < 3; ++i) {
    answer(b);
    answer(c);
  }
  ASSERT_EQ(status(job).state, JobState::done);
  coordinator->worker_disconnected(liar, now, effects);
  flush();
  EXPECT_FALSE(worker("liar").connected) << "still listed";
  const JobId next = submit_verified(0, "next");
  EXPECT_EQ(waiting(other_name), 0u);
  EXPECT_EQ(coordinator->release_worker("b", now, effects).code(), StatusCode::kNotFound);
  ASSERT_TRUE(coordinator->release_worker("liar", now, effects).ok());
  flush();
  EXPECT_EQ(written<DropQuarantine>(), 1u);
  EXPECT_EQ(worker("liar2").quarantine, "");
  answer(b);
  answer(c);
  EXPECT_EQ(status(next).state, JobState::done);
  submit_verified(0, "last", {0, 0, 256, 64});
  EXPECT_EQ(waiting(other_name), 1u);
}

TEST_F(QuarantineTest, AConvictedDepartedWorkerIsForgottenWithItsLeases) {
  limits.max_workers = 3;
  limits.disconnect_grace = std::chrono::hours(1);
  limits.lease_duration = std::chrono::hours(1);
  restart({});
  submit_verified(1, "r1", {0, 0, 256, 64});
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
  const JobId job = submit_verified(1, "r1", {0, 0, 128, 64});
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
