// How methods are chosen on the farm.
#include "common/film/error_goal.h"
#include "tests/unit/server/coordinator_fixture.h"

namespace lightmill {
namespace {

class PilotTest : public test::CoordinatorTest {
 protected:
  JobId submit_undecided(const std::string& request_id = "r1") { return submit_undecided(spec(request_id)); }
  JobId submit_undecided(JobSpec job) {
    job.settings.method = "auto";
    const Result<JobId> id = coordinator->submit(job, now, unix_ms(), step, {true, {"two do"}, {}, {"path", "ao"}});
    EXPECT_TRUE(id.ok()) << id.status();
    flush();
    return *id;
  }
  PilotGrant pilot(SessionId session) const {
    const std::vector<PilotGrant> grants = got<PilotGrant>(session);
    EXPECT_FALSE(grants.empty());
    return grants.empty() ? PilotGrant{} : grants.back();
  }
  void report(SessionId session, std::uint32_t choice) {
    say(session, PilotReport{pilot(session).lease, choice, {"it is cheaper"}, 0.5});
  }
  /// Time passes, and these workers are alive.
  void live(Duration time, std::initializer_list<SessionId> sessions) {
    constexpr Duration kStep = std::chrono::milliseconds(100);
    for (Duration done{}; done < time; done += kStep) {
      pass(kStep);
      for (const SessionId session : sessions) {
        std::vector<LeaseId> held;
        for (const PilotGrant& grant : got<PilotGrant>(session)) {
          held.push_back(grant.lease);
        }
        say(session, WorkerHeartbeat{held});
      }
    }
  }
  /// The job's last row.
  JobRecord stored() const {
    for (auto at = writes.rbegin(); at != writes.rend(); ++at) {
      if (const auto* put = std::get_if<PutJob>(&*at)) {
        return put->record;
      }
    }
    return {};
  }
};

TEST_F(PilotTest, OneWorkerRunsItAndNothingIsRenderedBefore) {
  const SessionId a = connect("a"), b = connect("b");
  const JobId job = submit_undecided();
  EXPECT_EQ(got<PilotGrant>(a).size() + got<PilotGrant>(b).size(), 1u);
  EXPECT_TRUE(got<LeaseGrant>(a).empty() && got<LeaseGrant>(b).empty());
  EXPECT_EQ(pilot(a).methods, (std::vector<std::string>{"path", "ao"}));
  EXPECT_EQ(pilot(a).settings.method, "auto");
  EXPECT_EQ(status(job).method, "auto");
  EXPECT_EQ(status(job).render_digest, Sha256{});
  EXPECT_EQ(status(job).fingerprint_class, "class-a") << "who runs it decides whose bits the picture has";
  pass(limits.copy_after - std::chrono::milliseconds(1));
  EXPECT_EQ(got<PilotGrant>(a).size() + got<PilotGrant>(b).size(), 1u) << "no copies yet";
}

TEST_F(PilotTest, ASlowPilotIsGivenToAnotherWorkerToo) {
  const SessionId z = connect("z");
  const JobId job = submit_undecided();
  const LeaseId slow = pilot(z).lease;
  const SessionId stranger = connect("a", 1, "class-b"), b = connect("b"), c = connect("c");
  live(limits.copy_after, {z, stranger, b, c});
  EXPECT_TRUE(got<PilotGrant>(b).empty());
  live(std::chrono::seconds(30), {z, stranger, b, c});
  EXPECT_EQ(got<PilotGrant>(b).size(), 1u) << "that a worker of another class comes first hides nothing";
  EXPECT_TRUE(got<PilotGrant>(stranger).empty() && got<PilotGrant>(c).empty()) << "one copy";
  report(b, 1);
  EXPECT_EQ(status(job).method, "ao");
  ASSERT_EQ(got<LeaseCancel>(z).size(), 1u);
  EXPECT_EQ(got<LeaseCancel>(z)[0].leases, std::vector<LeaseId>{slow});
  EXPECT_EQ(status(job).counters.leases_lost, 0u);
  report(z, 0);
  EXPECT_EQ(status(job).method, "ao");
  for (int i = 0; i < 3; ++i) {
    work(z);
    work(b);
    work(c);
  }
  EXPECT_EQ(status(job).state, JobState::done);
}

TEST_F(PilotTest, ACopyThatIsLostIsCopiedAgain) {
  const SessionId a = connect("a");
  const JobId job = submit_undecided();
  const SessionId b = connect("b"), c = connect("c");
  live(std::chrono::seconds(1), {a, b, c});
  ASSERT_EQ(got<PilotGrant>(b).size(), 1u);
  coordinator->worker_disconnected(b, now, step);
  flush();
  live(limits.disconnect_grace + std::chrono::seconds(1), {a, c});
  ASSERT_EQ(got<PilotGrant>(c).size(), 1u);
  report(c, 0);
  EXPECT_EQ(status(job).method, "path");
}

TEST_F(PilotTest, ItsChoiceIsStoredAndRendered) {
  const SessionId a = connect("a");
  const JobId job = submit_undecided();
  report(a, 1);
  EXPECT_EQ(status(job).method, "ao");
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
  coordinator->worker_message(a, PilotReport{pilot(a).lease, 0, {}, 0}, now, unix_ms(), step);
  const auto is_lease = [](const Outgoing& each) { return std::holds_alternative<LeaseGrant>(each.message); };
  EXPECT_TRUE(std::ranges::none_of(step.now, is_lease));
  EXPECT_TRUE(std::ranges::any_of(step.after_commit, is_lease));
}

TEST_F(PilotTest, ALostWorkersPilotGoesToAnother) {
  const SessionId a = connect("a");
  const JobId job = submit_undecided();
  const SessionId b = connect("b");
  const PilotGrant first = pilot(a);
  coordinator->worker_disconnected(a, now, step);
  flush();
  EXPECT_TRUE(got<PilotGrant>(b).empty());
  stand_still(limits.disconnect_grace + std::chrono::milliseconds(1));  // else b would get a copy before
  ASSERT_EQ(got<PilotGrant>(b).size(), 1u);
  EXPECT_NE(pilot(b).lease, first.lease);
  EXPECT_EQ(status(job).counters.leases_lost, 1u);
  report(b, 0);
  EXPECT_EQ(status(job).method, "path");
  const SessionId again = connect("a");
  say(again, PilotReport{first.lease, 1, {}, 0});
  EXPECT_EQ(status(job).method, "path") << "what comes late changes nothing";
}

TEST_F(PilotTest, AWorkerThatComesBackWithoutItGetsItAgain) {
  const SessionId a = connect("a");
  submit_undecided();
  coordinator->worker_disconnected(a, now, step);
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
  EXPECT_EQ(status(job).method, "auto") << "nobody has asked for it";
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
  EXPECT_EQ(status(job).method, "auto");
  EXPECT_EQ(got<PilotGrant>(a).size(), 2u) << "again";
  EXPECT_EQ(status(job).counters.leases_lost, 1u);
  say(a, PilotReport{LeaseId{12345}, 0, {}, 0});
  const SessionId b = connect("b");
  say(b, PilotReport{pilot(a).lease, 0, {}, 0});
  EXPECT_EQ(status(job).method, "auto") << "another's";
  say(a, PilotReport{pilot(a).lease, 0, {}, -1});
  EXPECT_EQ(status(job).method, "auto");
  ASSERT_EQ(got<PilotGrant>(b).size(), 1u) << "who was wrong twice is not asked at once";
  report(b, 0);
  EXPECT_EQ(status(job).method, "path");
}

TEST_F(PilotTest, AWorkerWhoseReportsAreDamagedIsDismissed) {
  const SessionId a = connect("a");
  const JobId job = submit_undecided();
  for (std::uint32_t i = 0; i < limits.max_bad_results; ++i) {
    EXPECT_TRUE(got<Dismissal>(a).empty());
    say(a, PilotReport{pilot(a).lease, 7, {}, 0});
    live(std::chrono::seconds(3), {a});
  }
  ASSERT_EQ(got<Dismissal>(a).size(), 1u);
  EXPECT_NE(got<Dismissal>(a)[0].reason.find("number 7"), std::string::npos) << got<Dismissal>(a)[0].reason;
  EXPECT_EQ(got<PilotGrant>(a).size(), limits.max_bad_results);
  const SessionId b = connect("b");
  report(b, 1);
  EXPECT_EQ(status(job).method, "ao");
}

TEST_F(PilotTest, ReasonsAreFewShortAndSafeToPrint) {
  const SessionId a = connect("a");
  const JobId job = submit_undecided();
  say(a, PilotReport{pilot(a).lease, 0, {"one", "two", "three", "four"}, 0});
  EXPECT_EQ(status(job).method, "auto") << "more reasons than methods";
  say(a, PilotReport{pilot(a).lease, 0, {std::string(1025, 'x')}, 0});
  EXPECT_EQ(status(job).method, "auto");
  const SessionId b = connect("b");
  say(b, PilotReport{pilot(b).lease, 0, {"red\x1b[31m", std::string(1024, 'x')}, 0});
  EXPECT_EQ(status(job).method, "path");
  EXPECT_EQ(status(job).method_notes.reasons,
            (std::vector<std::string>{"two do", "red\\x1b[31m", std::string(1024, 'x')}));
}

TEST_F(PilotTest, ItsTimeIsNoneOfTheJobsSeconds) {
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
  EXPECT_EQ(status(id).method, "ao");
  EXPECT_GE(status(id).min_tile_samples, 1u);
}

TEST_F(PilotTest, AnotherRenderersWorkerGetsNone) {
  const SessionId older{next_session++};
  coordinator->worker_connected(older, WorkerHello{"a", "host", 1, 1, "class-a", "lightmill-core-3", {}, false}, now,
                                step);
  submit_undecided();
  EXPECT_TRUE(got<PilotGrant>(older).empty()) << "it may not even know what a pilot is";
  EXPECT_EQ(got<PilotGrant>(connect("b")).size(), 1u);
}

TEST_F(PilotTest, WhoLosesPilotsWaitsLongerEachTime) {
  SessionId a = connect("a");
  const JobId job = submit_undecided();
  for (int i = 0; i < 1000; ++i) {  // for a hundred seconds its stream breaks as soon as it has a pilot
    if (!got<PilotGrant>(a).empty()) {
      coordinator->worker_disconnected(a, now, step);
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
  EXPECT_EQ(status(job).method, "path");
  work(a);
  EXPECT_EQ(status(job).state, JobState::done);
}

TEST_F(PilotTest, ASceneThatCannotBeRenderedFailsTheJob) {
  const SessionId a = connect("a");
  const JobId job = submit_undecided();
  say(a, WorkerRefusal{job, "an asset is damaged"});
  EXPECT_EQ(status(job).state, JobState::failed);
}

TEST_F(PilotTest, ACancelledJobTakesItsPilotBack) {
  const SessionId a = connect("a");
  const JobId job = submit_undecided();
  ASSERT_TRUE(coordinator->cancel(job, now, unix_ms(), step).ok());
  flush();
  ASSERT_EQ(got<LeaseCancel>(a).size(), 1u);
  EXPECT_EQ(got<LeaseCancel>(a)[0].leases, std::vector<LeaseId>{pilot(a).lease});
  report(a, 0);
  EXPECT_EQ(status(job).state, JobState::cancelled);
}

TEST_F(PilotTest, OtherJobsGoOnMeanwhile) {
  const SessionId a = connect("a");
  submit_undecided("r1");
  const JobId other = submit(spec("r2"));
  work(a);
  EXPECT_EQ(status(other).state, JobState::done);
}

TEST_F(PilotTest, ResultsOfAJobWithoutAMethodAreNotWanted) {
  const SessionId a = connect("a");
  const JobId job = submit_undecided();
  say(a, result(LeaseGrant{LeaseId{77}, Unit{job, {0, 0}, {TileId{0}}}}, TileId{0}));
  EXPECT_EQ(status(job).samples_done, 0u);
  const SessionId b = connect("b", 1, "class-a", {{LeaseId{78}, 1, Sha256{}, Unit{job, {0, 0}, {TileId{0}}}}});
  EXPECT_EQ(got<LeaseCancel>(b).size(), 1u);
}

TEST_F(PilotTest, CandidatesMustFitTheJob) {
  JobSpec job = spec();
  job.settings.method = "auto";
  EXPECT_EQ(coordinator->submit(job, now, 0, step).status().code(), StatusCode::kInvalidArgument) << "none";
  EXPECT_EQ(coordinator->submit(job, now, 0, step, {true, {}, {}, {"path", "magic"}}).status().code(),
            StatusCode::kInvalidArgument);
  job.settings.meters = 1;
  EXPECT_EQ(coordinator->submit(job, now, 0, step, {true, {}, {}, {"path", "ao"}}).status().code(),
            StatusCode::kInvalidArgument)
      << "ao reads no meters";
}

class AllocationTest : public PilotTest {
 protected:
  /// Two tiles, unless the film is another.
  JobId submit_adaptive(Goal goal, PixelRect crop = {0, 0, 128, 64}) {
    JobSpec job = spec("r1", 0, crop);
    job.goal = goal;
    job.goal.adaptive = true;
    const Result<JobId> id = coordinator->submit(job, now, unix_ms(), step, {false, {}, {}, {"path"}});
    EXPECT_TRUE(id.ok()) << id.status();
    flush();
    return *id;
  }
  void allocate(SessionId session, std::vector<std::int8_t> shifts) {
    PilotReport report{pilot(session).lease, 0, {"by noise"}, 0.5};
    report.allocation = Allocation::of(std::move(shifts)).value();
    say(session, report);
  }
  std::pair<std::uint64_t, std::uint64_t> samples(JobId job) const {
    const Film* const film = coordinator->film(job);
    return {film->samples(TileId{0}), film->samples(TileId{1})};
  }
};

TEST_F(AllocationTest, APilotSaysWhatEachTileGets) {
  const SessionId a = connect("a");
  const JobId job = submit_adaptive({.samples = 100});
  EXPECT_TRUE(pilot(a).allocate);
  EXPECT_EQ(pilot(a).methods, std::vector<std::string>{"path"});
  EXPECT_EQ(status(job).samples_wanted, 100u * 128 * 64);
  allocate(a, {-1, 2});
  EXPECT_EQ(stored().allocation, Allocation::of({-1, 2}).value());
  EXPECT_EQ(status(job).samples_wanted, (50u + 400) * 64 * 64);
  work(a);
  EXPECT_EQ(status(job).state, JobState::done);
  EXPECT_EQ(status(job).reason, "reached 100 samples per pixel");
  EXPECT_EQ(samples(job), (std::pair{std::uint64_t{50}, std::uint64_t{400}}));
  // Extended, also after a restart.
  StoredState state{2, {{stored(), {}}}, 2};
  for (std::uint32_t tile = 0; tile < 2; ++tile) {
    for (const NodePtr& node : coordinator->film(job)->forest(TileId{tile})) {
      state.jobs[0].nodes.push_back({TileId{tile}, node});
    }
  }
  restart(std::move(state));
  EXPECT_EQ(status(job).state, JobState::done);
  EXPECT_FALSE(coordinator->extend(job, {.samples = 100}, now, step).ok());
  ASSERT_TRUE(coordinator->extend(job, {.samples = 102}, now, step).ok());
  flush();
  const SessionId b = connect("b");
  pass(limits.restart_grace + std::chrono::seconds(1));
  work(b);
  EXPECT_EQ(status(job).state, JobState::done);
  EXPECT_EQ(samples(job), (std::pair{std::uint64_t{51}, std::uint64_t{408}}));
}

TEST_F(AllocationTest, AnErrorIsReadWhereAllTilesHaveTheirParts) {
  first_extra = 16;
  const SessionId a = connect("a");
  const JobId job = submit_adaptive({.error = 0.02});
  allocate(a, {-2, 1});
  work(a);
  EXPECT_EQ(status(job).reached, GoalLimit::error);
  const auto [quiet, noisy] = samples(job);
  EXPECT_TRUE(is_error_count(4 * quiet)) << quiet;
  EXPECT_EQ(noisy, 8 * quiet);
  EXPECT_LE(status(job).error.rel_mse + status(job).error.half_width, 0.02);
}

TEST_F(AllocationTest, NoErrorIsReadBeforeTheQuietestTileHasWhatAnEvenFramesHave) {
  for (const auto& [shifts, first] : std::initializer_list<std::pair<std::vector<std::int8_t>, std::uint64_t>>{
           {{-2, 1}, 64}, {{1, -1}, 32}, {{0, 2}, 16}, {{}, 16}}) {
    restart({});
    const SessionId a = connect("a");
    const JobId job = submit_adaptive({.error = 1000});
    allocate(a, shifts);
    work(a);
    EXPECT_EQ(status(job).reached, GoalLimit::error);
    EXPECT_EQ(coordinator->film(job)->frame_samples(), first);
    EXPECT_EQ(coordinator->film(job)->min_samples(), 16u);
    // Nor is any kept.
    ASSERT_EQ(status(job).history.size(), 1u);
    EXPECT_EQ(status(job).history[0].samples,
              static_cast<double>(status(job).samples_done) / coordinator->film(job)->grid().pixel_count());
  }
}

TEST_F(AllocationTest, HowItsErrorFellIsKeptAtFewCounts) {
  constexpr int kTiles = 16;
  std::vector<std::int8_t> shifts(kTiles, -2);
  shifts[3] = 2;
  const JobId job = submit_adaptive({.samples = 1000}, {0, 0, 64 * kTiles, 64});
  const SessionId a = connect("a");
  allocate(a, shifts);
  work(a);
  ASSERT_EQ(status(job).state, JobState::done);
  const std::vector<ErrorPoint> history = status(job).history;
  EXPECT_GE(history.size(), 3u);
  EXPECT_LE(history.size(), 9u);  // 64, 96, 128, 192, 256, 384, 512, 768 and the end
  EXPECT_EQ(history.back().samples, (15 * 250 + 4000) / 16.0);
  // Each is a row of the store's with all of the job in it.
  const auto rows = std::ranges::count_if(writes, [](const StoreOp& op) { return std::holds_alternative<PutJob>(op); });
  EXPECT_LE(static_cast<std::size_t>(rows), history.size() + 4) << "submitted, started, chosen, done";
  // A coordinator that is started again goes on where it was.
  StoredState state{2, {{stored(), {}}}, 2};
  for (std::uint32_t tile = 0; tile < kTiles; ++tile) {
    for (const NodePtr& node : coordinator->film(job)->forest(TileId{tile})) {
      state.jobs[0].nodes.push_back({TileId{tile}, node});
    }
  }
  restart(std::move(state));
  ASSERT_TRUE(coordinator->extend(job, {.samples = 2000}, now, step).ok());
  flush();
  const SessionId b = connect("b");
  pass(limits.restart_grace + std::chrono::seconds(1));
  work(b);
  EXPECT_EQ(status(job).state, JobState::done);
  EXPECT_LE(status(job).history.size(), history.size() + 3);  // 1024, 1536 and the end
}

TEST_F(AllocationTest, TheEtaOfAnErrorGoesByTheFramesCount) {
  first_extra = 16;
  const JobId job = submit_adaptive({.error = 0.0065});
  const SessionId a = connect("a");
  allocate(a, {-2, 0});
  const Film* const film = coordinator->film(job);
  for (std::size_t i = 0; i < got<LeaseGrant>(a).size() && film->frame_samples() < 64; ++i) {
    now += std::chrono::milliseconds(20);
    finish(a, got<LeaseGrant>(a)[i]);
  }
  const JobStatus seen = status(job);
  ASSERT_EQ(seen.samples_done, (16u + 64) * 64 * 64);
  // Errors fall as 1/samples: from what 64 of the frame have to what is asked for, with 5/8 a pixel.
  const double wanted = 64 * (seen.error.rel_mse + seen.error.half_width) / 0.0065;
  ASSERT_GT(wanted, 512);
  ASSERT_LT(wanted, 768);
  EXPECT_NEAR(seen.eta_seconds * seen.samples_per_second, (768 - 64) * 5.0 / 8 * 128 * 64, 1);
}

TEST_F(AllocationTest, WhatItSaysIsChecked) {
  const SessionId a = connect("a");
  const JobId job = submit_adaptive({.samples = 8});
  allocate(a, {1});
  EXPECT_NE(stored().method_notes.candidates.size(), 0u) << "one of two tiles";
  allocate(a, {});
  EXPECT_TRUE(stored().allocation.even());
  work(a);
  EXPECT_EQ(samples(job), (std::pair{std::uint64_t{8}, std::uint64_t{8}}));
  // Of a job that asks for none.
  const JobId other = submit_undecided("r2");
  allocate(a, {1, 1});
  EXPECT_EQ(status(other).method, "auto");
  JobSpec most = spec("r3", kMaxSamples);
  most.goal.adaptive = true;
  EXPECT_EQ(message_of(coordinator->submit(most, now, unix_ms(), step).status()),
            fmt::format("goal.samples: at most {}, got {}", kMaxSamples / 4, kMaxSamples));
}

}  // namespace
}  // namespace lightmill
