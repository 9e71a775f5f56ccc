// Liars and bad machines: what a coordinator does about results that differ.
#include "tests/unit/server/coordinator_fixture.h"

namespace lightmill {
namespace {

class VerifyingTest : public test::CoordinatorTest {
 protected:
  /// A worker on a machine of its own.
  SessionId connect_on(const std::string& machine, const std::string& name, std::uint32_t pid = 1) {
    const SessionId session{next_session++};
    WorkerHello hello{name, "host", pid, 1, "class-a", kRendererVersion, {}, false, machine};
    coordinator->worker_connected(session, hello, now, step);
    flush();
    return session;
  }
  JobId submit_verified(double share = 1, const std::string& request = "r1", PixelRect crop = {0, 0, 64, 64}) {
    JobSpec job = spec(request, 1, crop);
    job.verify_share = share;
    return submit(job);
  }
  /// Answers every lease that the session has not answered, with bits that differ by `lie`.
  void answer(SessionId session, float lie = 0) {
    std::size_t& done = worked[session];
    while (done < got<LeaseGrant>(session).size()) {
      const LeaseGrant grant = got<LeaseGrant>(session)[done++];
      for (const TileId tile : grant.unit.tiles) {
        WorkerResult sent_result = result(grant, tile);
        sent_result.node.values[0] += lie;
        sent_result.hash = hash_of(sent_result.node);
        say(session, sent_result);
      }
    }
  }
  std::size_t waiting(SessionId session) const {
    const auto done = worked.find(session);
    return got<LeaseGrant>(session).size() - (done == worked.end() ? 0 : done->second);
  }
  /// Time passes while these say that they are there.
  void pass_with(const std::vector<SessionId>& sessions, Duration time) {
    for (const Time until = now + time; now < until;) {
      pass(std::min<Duration>(limits.heartbeat_interval, until - now));
      for (const SessionId session : sessions) {
        say(session, WorkerHeartbeat{});
      }
    }
  }
  /// What a store gives back of this job, one of whose results is stored and still to be verified.
  StoredState stored_with(JobId job, const WorkerResult& merged, const Renderer& by) const {
    StoredState stored{2, {}, job.value + 1};
    JobRecord record;
    for (const StoreOp& op : writes) {
      if (const auto* put = std::get_if<PutJob>(&op)) {
        record = put->record;
      }
    }
    stored.jobs.push_back({record, {{merged.key.tile, std::make_shared<const Node>(merged.node)}}});
    stored.jobs[0].results = {{merged.key.tile, merged.key.range, merged.hash, 0, true}};
    stored.renderers = {by};
    return stored;
  }
  template <class T>
  std::size_t written() const {
    return static_cast<std::size_t>(
        std::ranges::count_if(writes, [](const StoreOp& op) { return std::holds_alternative<T>(op); }));
  }
  WorkerStatus worker(const std::string& name) const {
    for (const WorkerStatus& each : coordinator->workers(now)) {
      if (each.name == name) {
        return each;
      }
    }
    return {};
  }
};

TEST_F(VerifyingTest, AResultIsRenderedAgainOnAnotherMachineBeforeTheJobIsDone) {
  const JobId job = submit_verified();
  const SessionId a = connect_on("m1", "a"), again = connect_on("m1", "a2"), b = connect_on("m2", "b");
  answer(a);
  EXPECT_EQ(status(job).state, JobState::running);
  EXPECT_EQ(waiting(again), 0u) << "two workers on one machine are one machine";
  ASSERT_EQ(waiting(b), 1u);
  EXPECT_EQ(got<LeaseGrant>(b)[0].unit, got<LeaseGrant>(a)[0].unit);
  EXPECT_EQ(status(job).results_unverified, 1u);
  answer(b);
  EXPECT_EQ(status(job).state, JobState::done);
  EXPECT_EQ(status(job).results_unverified, 0u);
  EXPECT_EQ(status(job).counters.results_verified, 1u);
  EXPECT_EQ(status(job).counters.results_merged, 1u);
  EXPECT_EQ(written<PutVerified>(), 1u);
}

TEST_F(VerifyingTest, WithoutAnotherMachineAJobIsDoneAndSaysSo) {
  const JobId job = submit_verified();
  const SessionId a = connect_on("m1", "a");
  connect_on("m1", "a2");
  answer(a);
  EXPECT_EQ(status(job).state, JobState::done);
  EXPECT_EQ(status(job).results_unverified, 1u);
  EXPECT_EQ(status(job).counters.results_verified, 0u);
}

TEST_F(VerifyingTest, AMachineThatWasHereLatelyIsWaitedFor) {
  const JobId job = submit_verified();
  const SessionId b = connect_on("m2", "b");
  coordinator->worker_disconnected(b, now, step);
  pass(limits.disconnect_grace + std::chrono::seconds(1));
  const SessionId a = connect_on("m1", "a");
  answer(a);
  EXPECT_EQ(status(job).state, JobState::running);
  ASSERT_TRUE(coordinator->next_deadline());
  pass(limits.verifier_patience / 2);
  EXPECT_EQ(status(job).state, JobState::running);
  pass(limits.verifier_patience / 2);
  EXPECT_EQ(status(job).state, JobState::done);
}

TEST_F(VerifyingTest, AMachineIsNotGivenUpBecauseTheCoordinatorStoodStill) {
  const JobId job = submit_verified();
  const SessionId a = connect_on("m1", "a"), b = connect_on("m2", "b");
  answer(a);
  coordinator->worker_disconnected(b, now, step);
  pass_with({a}, std::chrono::seconds(5));
  stand_still(limits.verifier_patience * 2);
  EXPECT_EQ(status(job).state, JobState::running);
  const SessionId again = connect_on("m2", "b");
  answer(again);
  EXPECT_EQ(status(job).counters.results_verified, 1u);
}

TEST_F(VerifyingTest, OneOfWhichNothingIsHeardIsWaitedForNoLonger) {
  const JobId job = submit_verified();
  const SessionId b = connect_on("m2", "b"), a = connect_on("m1", "a");
  answer(b);
  ASSERT_EQ(waiting(a), 1u);
  pass_with({b}, limits.silence + std::chrono::seconds(1));
  EXPECT_EQ(hang_ups, std::vector{a});
  EXPECT_EQ(status(job).state, JobState::running) << "it may come back";
  pass_with({b}, limits.verifier_patience - limits.silence);
  EXPECT_EQ(status(job).state, JobState::done);
  EXPECT_EQ(status(job).results_unverified, 1u);
}

TEST_F(VerifyingTest, WhileNothingIsHandedOutWhatIsToBeVerifiedIsKept) {
  const JobId job = submit_verified();
  const SessionId a = connect_on("m1", "a"), b = connect_on("m2", "b");
  coordinator->hold("waits for space", now, step);
  flush();
  answer(a);
  pass_with({a, b}, limits.verifier_patience * 2);
  EXPECT_EQ(waiting(b), 0u);
  EXPECT_EQ(status(job).state, JobState::running);
  EXPECT_EQ(status(job).reason, "waits for space");
  coordinator->hold("", now, step);
  flush();
  answer(b);
  EXPECT_EQ(status(job).state, JobState::done);
  EXPECT_EQ(status(job).counters.results_verified, 1u);
}

TEST_F(VerifyingTest, AJobThatIsDeletedTakesWhatIsToBeVerifiedWithIt) {
  limits.keep_ended = std::chrono::hours(10);
  restart({});
  const JobId job = submit_verified();
  const SessionId a = connect_on("m1", "a");
  answer(a);
  ASSERT_EQ(status(job).state, JobState::done);
  ASSERT_EQ(status(job).results_unverified, 1u);
  coordinator->worker_disconnected(a, now, step);
  pass(limits.keep_ended + std::chrono::minutes(2));
  EXPECT_FALSE(coordinator->status(job, now).ok());
  EXPECT_EQ(written<DeleteJobRows>(), 1u);
  const SessionId b = connect_on("m2", "b");
  const JobId next = submit_verified(0, "next");
  EXPECT_EQ(waiting(b), 1u);
  answer(b);
  EXPECT_EQ(status(next).state, JobState::done);
}

TEST_F(VerifyingTest, NothingIsVerifiedWhereNobodyAsksForIt) {
  const JobId job = submit_verified(0);
  const SessionId a = connect_on("m1", "a"), b = connect_on("m2", "b");
  answer(a);
  EXPECT_EQ(waiting(b), 0u);
  EXPECT_EQ(status(job).state, JobState::done);
}

TEST_F(VerifyingTest, AThirdMachineDecidesAndTheLiarsWorkIsUndone) {
  const JobId job = submit_verified();
  const SessionId liar = connect_on("m1", "liar"), b = connect_on("m2", "b");
  answer(liar, 1);
  answer(b);
  EXPECT_EQ(status(job).state, JobState::running);
  EXPECT_NE(status(job).reason.find("differ between liar on m1 and b on m2"), std::string::npos) << status(job).reason;
  pass_with({liar, b}, limits.verifier_patience * 2);
  EXPECT_EQ(status(job).state, JobState::running) << "it waits for one who decides";
  const SessionId c = connect_on("m3", "c");
  EXPECT_EQ(status(job).reason, "");
  ASSERT_EQ(waiting(c), 1u);
  answer(c);
  EXPECT_EQ(worker("liar").quarantine,
            "its samples [0, 1) of the 64x64 pixels at 0, 0 of job 1 differ from what b on m2 and c on m3 have "
            "rendered alike");
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
  EXPECT_EQ(coordinator->film(job)->sums(TileId{0})[0], 1.0f) << "the honest ones'";
}

TEST_F(VerifyingTest, WhoWronglyContradictsIsTheLiar) {
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

TEST_F(VerifyingTest, ThreeThatDifferAccuseTheProgramAndNobodyElse) {
  const JobId job = submit_verified();
  const SessionId a = connect_on("m1", "a"), b = connect_on("m2", "b"), c = connect_on("m3", "c");
  answer(a, 1);
  answer(b, 2);
  answer(c, 3);
  EXPECT_EQ(status(job).state, JobState::paused);
  EXPECT_NE(status(job).reason.find("came out in 3 ways, on a on m1 and b on m2 and c on m3"), std::string::npos)
      << status(job).reason;
  EXPECT_EQ(written<PutQuarantine>(), 0u);
  ASSERT_TRUE(coordinator->resume(job, now, step).ok());
  flush();
  EXPECT_EQ(status(job).reason, "");
  for (int i = 0; i < 2; ++i) {
    answer(a);
    answer(b);
    answer(c);
  }
  EXPECT_EQ(status(job).state, JobState::done);
}

TEST_F(VerifyingTest, ADoneJobWithResultsOfALiarGoesOn) {
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
  EXPECT_EQ(coordinator->film(first)->sums(TileId{0})[0], 1.0f);
}

TEST_F(VerifyingTest, ADoneJobWhoseSecondsAreOverIsDoneAgainWithWhatIsLeft) {
  JobSpec timed = spec("first", 0, {0, 0, 64, 64});
  timed.goal.seconds = 5;
  timed.verify_share = 0;
  const JobId first = submit(timed);
  const SessionId b = connect_on("m2", "b");
  const LeaseGrant honest = got<LeaseGrant>(b).at(0);
  say(b, result(honest, TileId{0}));
  coordinator->worker_disconnected(b, now, step);
  const SessionId liar = connect_on("m1", "liar");
  pass_with({liar}, std::chrono::seconds(6));  // its seconds are over, and what b held is the liar's
  answer(liar, 1);
  ASSERT_EQ(status(first).state, JobState::done);
  const std::uint64_t before = status(first).frame_samples;
  submit_verified(1, "second");
  const SessionId c = connect_on("m3", "c"), d = connect_on("m4", "d");
  for (const SessionId session : {liar, c, d}) {
    answer(session, session == liar ? 1 : 0);
  }
  ASSERT_NE(worker("liar").quarantine, "");
  pass_with({c, d}, std::chrono::seconds(1));
  EXPECT_EQ(status(first).state, JobState::done);
  EXPECT_LT(status(first).frame_samples, before);
  EXPECT_EQ(status(first).frame_samples, honest.unit.range.end());
}

TEST_F(VerifyingTest, QuarantineHoldsForTheMachineAndUntilReleased) {
  const JobId job = submit_verified();
  const SessionId liar = connect_on("m1", "liar"), b = connect_on("m2", "b"), c = connect_on("m3", "c");
  answer(liar, 1);
  answer(b);
  answer(c);
  ASSERT_NE(worker("liar").quarantine, "");
  const SessionId other_name = connect_on("m1", "liar2");
  EXPECT_NE(worker("liar2").quarantine.find("it is on the machine of liar"), std::string::npos);
  for (int i = 0; i < 3; ++i) {
    answer(b);
    answer(c);
  }
  ASSERT_EQ(status(job).state, JobState::done);
  coordinator->worker_disconnected(liar, now, step);
  flush();
  EXPECT_FALSE(worker("liar").connected) << "still listed";
  const JobId next = submit_verified(0, "next");
  EXPECT_EQ(waiting(other_name), 0u);
  EXPECT_EQ(coordinator->release_worker("b", now, step).code(), StatusCode::kNotFound);
  ASSERT_TRUE(coordinator->release_worker("liar", now, step).ok());
  flush();
  EXPECT_EQ(written<DropQuarantine>(), 1u);
  EXPECT_EQ(worker("liar2").quarantine, "");
  answer(b);
  answer(c);
  EXPECT_EQ(status(next).state, JobState::done);
  submit_verified(0, "last", {0, 0, 256, 64});
  EXPECT_EQ(waiting(other_name), 1u);
}

TEST_F(VerifyingTest, ARestartForgetsNeitherQuarantineNorWhatIsToBeVerified) {
  const JobId job = submit_verified();
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
  EXPECT_EQ(status(job).results_unverified, 1u);
  const SessionId liar = connect_on("m9", "liar");
  const SessionId b = connect_on("m2", "b");
  pass(limits.restart_grace);
  EXPECT_EQ(waiting(liar), 0u);
  ASSERT_EQ(waiting(b), 1u);
  answer(b);
  EXPECT_EQ(status(job).state, JobState::done);
  EXPECT_EQ(status(job).counters.results_verified, 1u);
}

TEST_F(VerifyingTest, NothingOfACancelledJobIsToBeVerifiedAfterARestartEither) {
  const JobId job = submit_verified();
  const SessionId a = connect_on("m1", "a"), b = connect_on("m2", "b");
  const WorkerResult first = result(got<LeaseGrant>(a)[0], TileId{0});
  say(a, first);
  ASSERT_EQ(status(job).results_unverified, 1u);
  ASSERT_TRUE(coordinator->cancel(job, now, unix_ms(), step).ok());
  flush();
  EXPECT_EQ(got<LeaseCancel>(b).size(), 1u);
  EXPECT_EQ(status(job).results_unverified, 0u);
  restart(stored_with(job, first, {"a", "m1"}));
  EXPECT_EQ(status(job).state, JobState::cancelled);
  EXPECT_EQ(status(job).results_unverified, 0u);
}

TEST_F(VerifyingTest, AWorkerThatIsGoneAndFoundToBeWrongIsForgottenWithItsLeases) {
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
  coordinator->worker_disconnected(liar, now, step);
  flush();
  const SessionId c = connect_on("m3", "c");
  for (int i = 0; i < 6; ++i) {
    answer(b);
    answer(c);
  }
  ASSERT_NE(worker("liar").quarantine, "");
  connect_on("m4", "d");
  EXPECT_TRUE(worker("d").connected && worker("d").host == "host") << "there is room for three";
}

TEST_F(VerifyingTest, ResultsOfOneInQuarantineCountForNothing) {
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
}  // namespace lightmill
