// Choice of methods on the farm.
#include "tests/unit/server/pilot_fixture.h"

namespace lightmill::test {
namespace {

TEST_F(PilotTest, OneWorkerRunsThePilotBeforeAnyRendering) {
  const SessionId a = connect("a"), b = connect("b");
  const JobId job = submit_undecided();
  EXPECT_EQ(got<PilotGrant>(a).size() + got<PilotGrant>(b).size(), 1u);
  EXPECT_TRUE(got<LeaseGrant>(a).empty() && got<LeaseGrant>(b).empty());
  EXPECT_EQ(pilot(a).methods, (std::vector<std::string>{"path", "ao"}));
  EXPECT_EQ(pilot(a).settings.method, "auto");
  EXPECT_EQ(status(job).spec.settings.method, "auto");
  EXPECT_EQ(status(job).render_digest, Sha256{});
  EXPECT_EQ(status(job).fingerprint_class, "class-a") << "the job gets the class of the pilot's worker";
  pass(limits.copy_pilot_after - std::chrono::milliseconds(1));
  EXPECT_EQ(got<PilotGrant>(a).size() + got<PilotGrant>(b).size(), 1u) << "no copies yet";
}

TEST_F(PilotTest, ASlowPilotIsGivenToAnotherWorkerToo) {
  const SessionId z = connect("z");
  const JobId job = submit_undecided();
  const LeaseId slow = pilot(z).lease;
  const SessionId other_class = connect("a", 1, "class-b"), b = connect("b"), c = connect("c");
  live(limits.copy_pilot_after, {z, other_class, b, c});
  EXPECT_TRUE(got<PilotGrant>(b).empty());
  live(std::chrono::seconds(30), {z, other_class, b, c});
  EXPECT_EQ(got<PilotGrant>(b).size(), 1u) << "an earlier worker of another class is skipped";
  EXPECT_TRUE(got<PilotGrant>(other_class).empty() && got<PilotGrant>(c).empty()) << "one copy";
  report(b, 1);
  EXPECT_EQ(status(job).spec.settings.method, "ao");
  ASSERT_EQ(got<LeaseCancel>(z).size(), 1u);
  EXPECT_EQ(got<LeaseCancel>(z)[0].leases, std::vector<LeaseId>{slow});
  EXPECT_EQ(status(job).counters.leases_lost, 0u);
  report(z, 0);
  EXPECT_EQ(status(job).spec.settings.method, "ao");
  for (int i = 0; i < 3; ++i) {
    work(z);
    work(b);
    work(c);
  }
  EXPECT_EQ(status(job).state, JobState::done);
}

TEST_F(PilotTest, ALostCopyIsCopiedAgain) {
  const SessionId a = connect("a");
  const JobId job = submit_undecided();
  const SessionId b = connect("b"), c = connect("c");
  live(std::chrono::seconds(1), {a, b, c});
  ASSERT_EQ(got<PilotGrant>(b).size(), 1u);
  coordinator->worker_disconnected(b, now, effects);
  flush();
  live(limits.disconnect_grace + std::chrono::seconds(1), {a, c});
  ASSERT_EQ(got<PilotGrant>(c).size(), 1u);
  report(c, 0);
  EXPECT_EQ(status(job).spec.settings.method, "path");
}

TEST_F(PilotTest, ItsChoiceIsStoredAndRendered) {
  const SessionId a = connect("a");
  const JobId job = submit_undecided();
  report(a, 1);
  EXPECT_EQ(status(job).spec.settings.method, "ao");
  EXPECT_EQ(status(job).method_notes, (MethodNotes{true, {"two do", "it is cheaper"}, {}, {}}));
  EXPECT_EQ(status(job).worker_seconds, 0.5);
  const JobRecord record = stored();
  EXPECT_EQ(record.spec.settings.method, "ao");
  EXPECT_TRUE(record.method_notes.candidates.empty());
  EXPECT_EQ(status(job).render_digest, render_digest(record.spec.settings, "class-a"));
  const std::vector<JobDescription> descriptions = got<JobDescription>(a);
  ASSERT_EQ(descriptions.size(), 1u);
  EXPECT_EQ(descriptions[0].settings.method, "ao");
  work(a);
  EXPECT_EQ(status(job).state, JobState::done);
}

TEST_F(PilotTest, LeasesWaitUntilTheChoiceIsStored) {
  const SessionId a = connect("a");
  submit_undecided();
  coordinator->worker_message(a, PilotReport{pilot(a).lease, 0, {}, 0}, now, unix_ms(), effects);
  const auto is_lease = [](const Outgoing& each) { return std::holds_alternative<LeaseGrant>(each.message); };
  EXPECT_TRUE(std::ranges::none_of(effects.now, is_lease));
  EXPECT_TRUE(std::ranges::any_of(effects.after_commit, is_lease));
}

TEST_F(PilotTest, ALostWorkersPilotGoesToAnother) {
  const SessionId a = connect("a");
  const JobId job = submit_undecided();
  const SessionId b = connect("b");
  const PilotGrant first = pilot(a);
  coordinator->worker_disconnected(a, now, effects);
  flush();
  EXPECT_TRUE(got<PilotGrant>(b).empty());
  stand_still(limits.disconnect_grace + std::chrono::milliseconds(1));  // otherwise b would get a copy first
  ASSERT_EQ(got<PilotGrant>(b).size(), 1u);
  EXPECT_NE(pilot(b).lease, first.lease);
  EXPECT_EQ(status(job).counters.leases_lost, 1u);
  report(b, 0);
  EXPECT_EQ(status(job).spec.settings.method, "path");
  const SessionId again = connect("a");
  say(again, PilotReport{first.lease, 1, {}, 0});
  EXPECT_EQ(status(job).spec.settings.method, "path") << "a late report changes nothing";
}

TEST_F(PilotTest, AReturningWorkerGetsItsPilotAgain) {
  const SessionId a = connect("a");
  submit_undecided();
  coordinator->worker_disconnected(a, now, effects);
  flush();
  const SessionId again = connect("a");
  EXPECT_EQ(got<PilotGrant>(again).size(), 1u);
}

TEST_F(PilotTest, ARestartedCoordinatorAsksAgain) {
  const SessionId a = connect("a");
  const JobId job = submit_undecided();
  const PilotGrant before = pilot(a);
  StoredState state;
  state.epoch = 2;
  state.next_job_id = 2;
  state.jobs.push_back({stored(), {}});
  restart(std::move(state));
  EXPECT_EQ(status(job).render_digest, Sha256{});
  const SessionId again = connect("a");
  say(again, PilotReport{before.lease, 1, {}, 0});
  EXPECT_EQ(status(job).spec.settings.method, "auto") << "this report was not requested";
  pass(limits.restart_grace + std::chrono::milliseconds(1));
  ASSERT_EQ(got<PilotGrant>(again).size(), 1u);
  report(again, 0);
  work(again);
  EXPECT_EQ(status(job).state, JobState::done);
}

TEST_F(PilotTest, ADamagedReportIsNoChoice) {
  const SessionId a = connect("a");
  const JobId job = submit_undecided();
  const LeaseId lease = pilot(a).lease;
  say(a, PilotReport{lease, 2, {}, 0});
  EXPECT_EQ(status(job).spec.settings.method, "auto");
  EXPECT_EQ(got<PilotGrant>(a).size(), 2u) << "again";
  EXPECT_EQ(status(job).counters.leases_lost, 1u);
  say(a, PilotReport{LeaseId{12345}, 0, {}, 0});
  const SessionId b = connect("b");
  say(b, PilotReport{pilot(a).lease, 0, {}, 0});
  EXPECT_EQ(status(job).spec.settings.method, "auto") << "the report of another worker";
  say(a, PilotReport{pilot(a).lease, 0, {}, -1});
  EXPECT_EQ(status(job).spec.settings.method, "auto");
  ASSERT_EQ(got<PilotGrant>(b).size(), 1u) << "a worker with two invalid reports has to wait";
  report(b, 0);
  EXPECT_EQ(status(job).spec.settings.method, "path");
}

TEST_F(PilotTest, AWorkerWithDamagedReportsIsDismissed) {
  const SessionId a = connect("a");
  const JobId job = submit_undecided();
  for (std::uint32_t i = 0; i < limits.max_bad_results; ++i) {
    EXPECT_TRUE(got<Dismissal>(a).empty());
    say(a, PilotReport{pilot(a).lease, 7, {}, 0});
    live(std::chrono::seconds(3), {a});
  }
  ASSERT_EQ(got<Dismissal>(a).size(), 1u);
  EXPECT_NE(got<Dismissal>(a)[0].reason.find("choice: must be below 2, got 7"), std::string::npos)
      << got<Dismissal>(a)[0].reason;
  EXPECT_EQ(got<PilotGrant>(a).size(), limits.max_bad_results);
  const SessionId b = connect("b");
  report(b, 1);
  EXPECT_EQ(status(job).spec.settings.method, "ao");
}

TEST_F(PilotTest, ReasonsAreFewShortAndSafeToPrint) {
  const SessionId a = connect("a");
  const JobId job = submit_undecided();
  say(a, PilotReport{pilot(a).lease, 0, {"one", "two", "three", "four"}, 0});
  EXPECT_EQ(status(job).spec.settings.method, "auto") << "more reasons than methods";
  say(a, PilotReport{pilot(a).lease, 0, {std::string(1025, 'x')}, 0});
  EXPECT_EQ(status(job).spec.settings.method, "auto");
  const SessionId b = connect("b");
  say(b, PilotReport{pilot(b).lease, 0, {"red\x1b[31m", std::string(1024, 'x')}, 0});
  EXPECT_EQ(status(job).spec.settings.method, "path");
  EXPECT_EQ(status(job).method_notes.reasons,
            (std::vector<std::string>{"two do", "red\\x1b[31m", std::string(1024, 'x')}));
}

TEST_F(PilotTest, ThePilotsTimeDoesNotCountAsTheJobs) {
  const SessionId a = connect("a");
  JobSpec job = spec("r1", 0);
  job.goal.seconds = 0.5;
  const JobId id = submit_undecided(job);
  live(std::chrono::seconds(5), {a});
  EXPECT_EQ(status(id).state, JobState::running);
  EXPECT_EQ(status(id).active_seconds, 0);
  report(a, 1);
  const std::size_t first = got<LeaseGrant>(a).size();
  ASSERT_GT(first, 0u);
  pass(std::chrono::milliseconds(400));
  EXPECT_NEAR(status(id).active_seconds, 0.4, 1e-9);
  EXPECT_EQ(status(id).state, JobState::running);
  pass(std::chrono::milliseconds(200));
  work(a);
  EXPECT_EQ(status(id).state, JobState::done);
  EXPECT_EQ(status(id).spec.settings.method, "ao");
  EXPECT_GE(status(id).min_tile_samples, 1u);
}

TEST_F(PilotTest, AWorkerOfAnotherVersionGetsNoPilot) {
  const SessionId older{next_session++};
  coordinator->worker_connected(older, WorkerHello{"a", "host", 1, 1, "class-a", "lightmill-core-3", {}, false}, now,
                                effects);
  submit_undecided();
  EXPECT_TRUE(got<PilotGrant>(older).empty()) << "it may not know pilots";
  EXPECT_EQ(got<PilotGrant>(connect("b")).size(), 1u);
}

TEST_F(PilotTest, AWorkerThatLosesPilotsWaitsLongerEachTime) {
  SessionId a = connect("a");
  const JobId job = submit_undecided();
  for (int i = 0; i < 1000; ++i) {  // for a hundred seconds its stream breaks as soon as it has a pilot
    if (!got<PilotGrant>(a).empty()) {
      coordinator->worker_disconnected(a, now, effects);
      a = connect("a");
    }
    pass(std::chrono::milliseconds(100));
    say(a, WorkerHeartbeat{});
  }
  EXPECT_GE(status(job).counters.leases_lost, 5u);
  EXPECT_LE(status(job).counters.leases_lost, 11u);
  const SessionId b = connect("b");
  EXPECT_EQ(got<PilotGrant>(a).size() + got<PilotGrant>(b).size(), 1u) << "others need not wait";
}

TEST_F(PilotTest, AReportOfAUnitOfTilesIsIgnored) {
  const SessionId a = connect("a");
  const JobId job = submit(spec());
  say(a, PilotReport{got<LeaseGrant>(a).at(0).lease, 0, {}, 0});
  EXPECT_EQ(status(job).spec.settings.method, "path");
  work(a);
  EXPECT_EQ(status(job).state, JobState::done);
}

TEST_F(PilotTest, ASceneThatCannotBeRenderedFailsTheJob) {
  const SessionId a = connect("a");
  const JobId job = submit_undecided();
  say(a, WorkerRefusal{job, "an asset is damaged"});
  EXPECT_EQ(status(job).state, JobState::failed);
}

TEST_F(PilotTest, APilotTooLargeForOneWorkerGoesToAnother) {
  const SessionId a = connect("a");
  const JobId job = submit_undecided();
  const SessionId b = connect("b", 1, "class-b");
  say(a, WorkerRefusal{job, "too large", true});
  EXPECT_EQ(got<PilotGrant>(b).size(), 1u);
  EXPECT_EQ(status(job).fingerprint_class, "class-b");
  EXPECT_EQ(status(job).counters.leases_lost, 0u);
}

TEST_F(PilotTest, CancellingAJobCancelsItsPilot) {
  const SessionId a = connect("a");
  const JobId job = submit_undecided();
  ASSERT_TRUE(coordinator->cancel(job, now, unix_ms(), effects).ok());
  flush();
  ASSERT_EQ(got<LeaseCancel>(a).size(), 1u);
  EXPECT_EQ(got<LeaseCancel>(a)[0].leases, std::vector<LeaseId>{pilot(a).lease});
  report(a, 0);
  EXPECT_EQ(status(job).state, JobState::cancelled);
}

TEST_F(PilotTest, OtherJobsRenderMeanwhile) {
  const SessionId a = connect("a");
  submit_undecided("r1");
  const JobId other = submit(spec("r2"));
  work(a);
  EXPECT_EQ(status(other).state, JobState::done);
}

TEST_F(PilotTest, ResultsOfAJobWithoutAMethodAreDropped) {
  const SessionId a = connect("a");
  const JobId job = submit_undecided();
  const LeaseGrant grant = granted("a", LeaseId{77}, Unit{job, {0, 0}, {TileId{0}}}, Sha256{});
  say(a, result(grant, TileId{0}));
  EXPECT_EQ(status(job).samples_done, 0u);
  const SessionId b = connect("b", 1, "class-a", {{LeaseId{78}, 1, Sha256{}, grant.unit, grant.tags}});
  EXPECT_EQ(got<LeaseCancel>(b).size(), 1u);
}

TEST_F(PilotTest, CandidatesMustFitTheJob) {
  JobSpec job = spec();
  job.settings.method = "auto";
  EXPECT_EQ(coordinator->submit(job, now, 0, effects).status().code(), StatusCode::kInvalidArgument) << "none";
  EXPECT_EQ(coordinator->submit(job, now, 0, effects, {true, {}, {}, {"path", "magic"}}).status().code(),
            StatusCode::kInvalidArgument);
  job.settings.meters = 1;
  EXPECT_EQ(coordinator->submit(job, now, 0, effects, {true, {}, {}, {"path", "ao"}}).status().code(),
            StatusCode::kInvalidArgument)
      << "ao reads no meters";
}

}  // namespace
}  // namespace lightmill::test
