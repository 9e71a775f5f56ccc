// Jobs with an error goal.
#include "common/film/error_goal.h"
#include "tests/unit/server/coordinator_fixture.h"

namespace lightmill {
namespace {

/// With 16 for the first sample, relMSE is (16/n)²/((2 + 16/n)² + 0.01), and its interval 10 % of that: their sum is
/// 0.122 at 16 samples, 0.069 at 24, 0.044 at 32, 0.0224 at 48, 0.0136 at 64, 0.0065 at 96 and 0.0038 at 128.
class ErrorGoalTest : public test::CoordinatorTest {
 protected:
  ErrorGoalTest() { first_extra = 16; }

  static JobSpec error_spec(double error, std::uint64_t samples = 0, double seconds = 0) {
    JobSpec job = spec("r1", samples);
    job.goal = {samples, seconds, error};
    return job;
  }
  /// The stored state at this moment.
  StoredState stored_now(JobId job) const {
    StoredState stored{2, {{{}, {}}}, 2};
    for (const StoreOp& op : writes) {
      if (const auto* put = std::get_if<PutJob>(&op)) {
        stored.jobs[0].record = put->record;
      }
    }
    const Film* const film = coordinator->film(job);
    for (std::uint32_t tile = 0; tile < film->grid().tile_count(); ++tile) {
      for (const NodePtr& node : film->forest(TileId{tile})) {
        stored.jobs[0].nodes.push_back({TileId{tile}, node});
      }
    }
    return stored;
  }
};

TEST_F(ErrorGoalTest, AJobEndsAtTheFirstCountThatMeetsItsError) {
  for (const auto& [error, samples] :
       {std::pair{0.13, 16}, {0.07, 24}, {0.05, 32}, {0.03, 48}, {0.02, 64}, {0.01, 96}}) {
    restart({});
    const JobId job = submit(error_spec(error));
    const SessionId session = connect("w");
    work(session);
    EXPECT_EQ(status(job).state, JobState::done);
    EXPECT_EQ(status(job).reached, GoalLimit::error);
    EXPECT_EQ(status(job).min_tile_samples, static_cast<std::uint64_t>(samples)) << error;
    EXPECT_EQ(status(job).max_tile_samples, static_cast<std::uint64_t>(samples)) << error;
    EXPECT_LE(status(job).error.rel_mse + status(job).error.half_width, error);
    EXPECT_EQ(status(job).counters.results_duplicate, 0u);
  }
  EXPECT_EQ(status(JobId{1}).reason, "reached relMSE 0.0059 (95%: at most 0.0065) at 96 samples per pixel");
}

TEST_F(ErrorGoalTest, AJobKeepsItsErrorHistory) {
  JobSpec plain = spec("r1", 100);
  const JobId job = submit(plain);
  const SessionId session = connect("w");
  work(session);
  ASSERT_EQ(status(job).state, JobState::done);
  const std::vector<ErrorPoint> history = status(job).history;
  ASSERT_GE(history.size(), 3u);
  EXPECT_LE(history.size(), 7u);  // 16, 24, 32, 48, 64, 96 and the end
  EXPECT_GE(history.front().samples, 16);
  EXPECT_EQ(history.back().samples, 100);
  EXPECT_EQ(history.back().worker_seconds, status(job).worker_seconds);
  EXPECT_EQ(history.back().rel_mse, status(job).error.rel_mse);
  EXPECT_NEAR(history.back().rel_mse, 0.16 * 0.16 / 4.01, 1e-3);
  for (std::size_t i = 1; i < history.size(); ++i) {
    EXPECT_GT(history[i].samples, history[i - 1].samples);
    EXPECT_GT(history[i].worker_seconds, history[i - 1].worker_seconds);
    EXPECT_LT(history[i].rel_mse, history[i - 1].rel_mse);
  }

  // The history survives the coordinator, and continues when the job is extended.
  restart(stored_now(job));
  EXPECT_EQ(status(job).history, history);
  ASSERT_TRUE(coordinator->extend(job, {200, 0}, now, effects).ok());
  flush();
  work(connect("w2"));
  const std::vector<ErrorPoint> longer = status(job).history;
  EXPECT_EQ(longer.back().samples, 200);
  EXPECT_TRUE(std::ranges::equal(std::span(longer).first(history.size()), history));
}

TEST_F(ErrorGoalTest, NoLeaseExceedsTheNextErrorCount) {
  const JobId job = submit(error_spec(0.02));
  const SessionId session = connect("w", 4);
  std::size_t done = 0;
  while (done < got<LeaseGrant>(session).size()) {
    const LeaseGrant grant = got<LeaseGrant>(session)[done++];
    const std::uint64_t complete = status(job).min_tile_samples;
    EXPECT_LE(grant.unit.range.end(), next_error_count(complete + 1)) << "while " << complete << " are complete";
    finish(session, grant);
  }
  EXPECT_EQ(status(job).min_tile_samples, 64u);
}

TEST_F(ErrorGoalTest, AllWorkersAreServedOnceACountIsRead) {
  submit(error_spec(0.02));
  const SessionId first = connect("a"), second = connect("b");
  std::map<SessionId, std::size_t> done;
  // The second worker finishes the round and waits. Then the first one ends it.
  const auto work_to = [&](SessionId session, std::uint64_t end) {
    while (done[session] < got<LeaseGrant>(session).size() &&
           got<LeaseGrant>(session)[done[session]].unit.range.end() <= end) {
      finish(session, got<LeaseGrant>(session)[done[session]++]);
    }
  };
  work_to(second, 16);
  EXPECT_EQ(done[second], got<LeaseGrant>(second).size());
  work_to(first, 16);
  work_to(second, 16);
  EXPECT_GT(got<LeaseGrant>(first).size(), done[first]);
  EXPECT_GT(got<LeaseGrant>(second).size(), done[second]);
}

TEST_F(ErrorGoalTest, LeasesWaitForTheCommitOfTheReadNodes) {
  submit(error_spec(0.02));
  const SessionId session = connect("w");
  for (std::size_t done = 0; done < got<LeaseGrant>(session).size();) {
    const LeaseGrant grant = got<LeaseGrant>(session)[done++];
    for (const TileId tile : grant.unit.tiles) {
      coordinator->worker_message(session, result(grant, tile), now, unix_ms(), effects);
      EXPECT_TRUE(std::ranges::none_of(
          effects.now, [](const Outgoing& each) { return std::holds_alternative<LeaseGrant>(each.message); }));
      flush();
    }
  }
}

TEST_F(ErrorGoalTest, TheFirstLimitEndsTheJob) {
  const auto run = [&](const JobSpec& job_spec) {
    restart({});
    const JobId job = submit(job_spec);
    work(connect("w"));
    return status(job);
  };
  EXPECT_EQ(run(error_spec(0.02, 40)).reached, GoalLimit::samples);
  EXPECT_EQ(status(JobId{1}).min_tile_samples, 40u);
  EXPECT_EQ(run(error_spec(0.02, 100)).reached, GoalLimit::error);
  EXPECT_EQ(status(JobId{1}).min_tile_samples, 64u);
  EXPECT_EQ(run(error_spec(0.02, 64)).reached, GoalLimit::error) << "it reached both, and the error counts";

  restart({});
  const JobId job = submit(error_spec(0.02, 100, 5));
  const SessionId session = connect("w");
  finish(session, got<LeaseGrant>(session)[got<LeaseGrant>(session).size() - 1]);
  pass(std::chrono::seconds(6));
  for (const LeaseGrant& grant : got<LeaseGrant>(session)) {
    finish(session, grant);
  }
  EXPECT_EQ(status(job).state, JobState::done);
  EXPECT_EQ(status(job).reached, GoalLimit::seconds);
  EXPECT_EQ(status(job).reason, "reached 5 seconds");
}

TEST_F(ErrorGoalTest, ARestartAtAnyMomentLeadsToTheSameCountAndFilm) {
  std::size_t results = 0;
  for (bool done = false; !done; ++results) {
    restart({});
    writes.clear();
    sent.clear();
    const JobId job = submit(error_spec(0.02));
    const SessionId session = connect("w");
    // Some results, then another coordinator with the stored state and a worker that holds nothing.
    std::size_t came = 0;
    for (std::size_t i = 0; came < results && i < got<LeaseGrant>(session).size(); ++i) {
      const LeaseGrant grant = got<LeaseGrant>(session)[i];
      for (std::size_t t = 0; t < grant.unit.tiles.size() && came < results; ++t, ++came) {
        say(session, result(grant, grant.unit.tiles[t]));
      }
    }
    done = status(job).state == JobState::done;
    restart(stored_now(job));
    const SessionId again = connect("w");
    pass(limits.restart_grace);
    work(again);
    ASSERT_EQ(status(job).state, JobState::done) << results;
    EXPECT_EQ(status(job).reached, GoalLimit::error) << results;
    EXPECT_EQ(status(job).min_tile_samples, 64u) << results;
    EXPECT_EQ(status(job).max_tile_samples, 64u) << results;
  }
  EXPECT_GT(results, 10u);
}

TEST_F(ErrorGoalTest, LostNodesAreRenderedAgain) {
  JobSpec one_tile = error_spec(0.03);
  one_tile.settings.crop = {0, 0, kTileSize, kTileSize};
  // They end at 48, with two nodes a tile.
  for (const JobSpec& job_spec : {error_spec(0.03), error_spec(0.03, 0, 1000), error_spec(0.03, 500), one_tile}) {
    restart({});
    writes.clear();
    const JobId job = submit(job_spec);
    work(connect("w"));
    ASSERT_EQ(status(job).min_tile_samples, 48u);
    const StoredState whole = stored_now(job);
    restart(stored_now(job));
    EXPECT_EQ(status(job).state, JobState::done);
    const std::size_t nodes = whole.jobs[0].nodes.size();
    ASSERT_EQ(nodes, 2 * coordinator->film(job)->grid().tile_count());
    for (std::uint32_t lost = 1; lost < 1u << nodes; ++lost) {  // every set of them
      StoredState stored = whole;
      std::erase_if(stored.jobs[0].nodes, [&, i = 0u](const auto&) mutable { return (lost >> i++ & 1) != 0; });
      restart(std::move(stored));
      EXPECT_EQ(status(job).state, JobState::running) << lost;
      EXPECT_EQ(status(job).finished_unix_ms, 0) << lost;
      const SessionId session = connect("w");
      pass(limits.restart_grace);
      work(session);
      EXPECT_EQ(status(job).state, JobState::done) << lost;
      EXPECT_EQ(status(job).reached, GoalLimit::error) << lost;
      EXPECT_EQ(status(job).min_tile_samples, 48u) << lost;
      EXPECT_EQ(status(job).max_tile_samples, 48u) << lost;
    }
  }
}

TEST_F(ErrorGoalTest, NoErrorIsReadOverAGap) {
  // Six workers on one tile. A slow one leaves a gap below the merged results of the others.
  JobSpec one_tile = spec("r1", 1000);
  one_tile.settings.crop = {0, 0, kTileSize, kTileSize};
  const JobId job = submit(one_tile);
  std::vector<SessionId> sessions;
  for (int i = 0; i < 6; ++i) {
    sessions.push_back(connect(fmt::format("w{}", i)));
  }
  std::map<SessionId, std::size_t> done;
  std::vector<std::pair<SessionId, LeaseGrant>> slow;
  const auto gap_at_a_count = [&] {
    const NodePtr& last = coordinator->film(job)->forest(TileId{0}).back();
    const std::uint64_t samples = status(job).min_tile_samples;
    return next_error_count(samples) == samples && last->range.end() != samples;
  };
  bool found = false;
  for (int round = 0; round < 60 && !found; ++round) {
    for (std::size_t i = 0; i < sessions.size() && !found; ++i) {
      const std::vector<LeaseGrant> grants = got<LeaseGrant>(sessions[i]);
      if (done[sessions[i]] == grants.size()) {
        continue;
      }
      const LeaseGrant& grant = grants[done[sessions[i]]++];
      if (grant.unit.range.first() == 32) {
        slow.emplace_back(sessions[i], grant);
      } else {
        finish(sessions[i], grant);
        found = gap_at_a_count();
      }
    }
  }
  ASSERT_TRUE(found);
  ASSERT_FALSE(slow.empty());
  ASSERT_TRUE(coordinator->extend(job, {0, 0.9}, now, effects).ok());
  flush();
  EXPECT_EQ(status(job).state, JobState::running);
  for (const auto& [session, grant] : slow) {
    finish(session, grant);
  }
  for (const SessionId session : sessions) {
    for (std::size_t i = done[session]; i < got<LeaseGrant>(session).size(); ++i) {
      finish(session, got<LeaseGrant>(session)[i]);
    }
  }
  EXPECT_EQ(status(job).state, JobState::done);
  EXPECT_EQ(status(job).reached, GoalLimit::error);
  EXPECT_EQ(next_error_count(status(job).min_tile_samples), status(job).min_tile_samples)
      << status(job).min_tile_samples;
  EXPECT_EQ(coordinator->film(job)->forest(TileId{0}).back()->range.end(), status(job).min_tile_samples);
}

TEST_F(ErrorGoalTest, AJobThatEndedBelowItsLimitOfSamplesIsExtendedFromItsSamples) {
  const JobId job = submit(error_spec(0.03, 256));
  const SessionId session = connect("w");
  work(session);
  ASSERT_EQ(status(job).min_tile_samples, 48u);
  EXPECT_EQ(coordinator->extend(job, {48}, now, effects).code(), StatusCode::kInvalidArgument);
  ASSERT_TRUE(coordinator->extend(job, {96}, now, effects).ok());
  flush();
  EXPECT_EQ(status(job).spec.goal, (Goal{96, 0, 0}));
  EXPECT_EQ(coordinator->extend(job, {96}, now, effects).code(), StatusCode::kInvalidArgument) << "it has not ended";
  work(session);
  EXPECT_EQ(status(job).reached, GoalLimit::samples);
  EXPECT_EQ(status(job).min_tile_samples, 96u);
  EXPECT_EQ(status(job).max_tile_samples, 96u);
}

TEST_F(ErrorGoalTest, ExtendingAsksForLessErrorOrForMoreSamples) {
  const JobId job = submit(error_spec(0.02));
  const SessionId session = connect("w");
  work(session);
  ASSERT_EQ(status(job).min_tile_samples, 64u);
  EXPECT_EQ(coordinator->extend(job, {0, 0.02}, now, effects).code(), StatusCode::kInvalidArgument);
  EXPECT_EQ(coordinator->extend(job, {0, -1}, now, effects).code(), StatusCode::kInvalidArgument);
  EXPECT_EQ(coordinator->extend(job, {0, NAN}, now, effects).code(), StatusCode::kInvalidArgument);
  EXPECT_EQ(coordinator->extend(job, {}, now, effects).code(), StatusCode::kInvalidArgument);
  ASSERT_TRUE(coordinator->extend(job, {0, 0.01}, now, effects).ok());
  flush();
  EXPECT_EQ(status(job).state, JobState::running);
  EXPECT_EQ(status(job).reached, GoalLimit::none);
  work(session);
  EXPECT_EQ(status(job).min_tile_samples, 96u);
  EXPECT_EQ(status(job).reached, GoalLimit::error);
  // An error that it has already ends it at once.
  ASSERT_TRUE(coordinator->extend(job, {0, 0.008}, now, effects).ok());
  flush();
  EXPECT_EQ(status(job).state, JobState::done);
  EXPECT_EQ(status(job).spec.goal, (Goal{0, 0, 0.008}));
  // More samples. The error is reached, and would end the job at once.
  ASSERT_TRUE(coordinator->extend(job, {100}, now, effects).ok());
  flush();
  EXPECT_EQ(status(job).spec.goal, (Goal{100, 0, 0}));
  work(session);
  EXPECT_EQ(status(job).min_tile_samples, 100u);
  EXPECT_EQ(status(job).reached, GoalLimit::samples);
  // From samples to an error: the samples are reached.
  ASSERT_TRUE(coordinator->extend(job, {0, 0.005}, now, effects).ok());
  flush();
  EXPECT_EQ(status(job).spec.goal, (Goal{0, 0, 0.005}));
  work(session);
  EXPECT_EQ(status(job).min_tile_samples, 128u);
  EXPECT_EQ(status(job).counters.results_duplicate, 0u);
}

TEST_F(ErrorGoalTest, GathersNeedTheBiasLayer) {
  JobSpec plain = spec("r1", 16), layered = spec("r2", 16);
  plain.settings.method = layered.settings.method = "caustic";
  layered.settings.layers = *film_layers(std::vector<std::string>{"bias"});
  const JobId without = submit(plain), with = submit(layered);
  const SessionId session = connect("w");
  work(session);
  ASSERT_EQ(status(without).state, JobState::done);
  EXPECT_EQ(coordinator->extend(without, {0, 0.01}, now, effects).code(), StatusCode::kFailedPrecondition);
  EXPECT_TRUE(coordinator->extend(with, {0, 0.01}, now, effects).ok());
  EXPECT_TRUE(coordinator->extend(without, {32}, now, effects).ok());
}

TEST_F(ErrorGoalTest, ARunningJobIsExtendedBeyondItsLeases) {
  const JobId job = submit(spec("r1", 1000));
  const SessionId session = connect("w");
  std::uint64_t out = 0;
  for (std::size_t i = 0; i < 20; ++i) {
    const LeaseGrant grant = got<LeaseGrant>(session)[i];
    finish(session, grant);
  }
  for (const LeaseGrant& grant : got<LeaseGrant>(session)) {
    out = std::max(out, grant.unit.range.end());
  }
  ASSERT_GT(out, 16u);
  ASSERT_TRUE(coordinator->extend(job, {0, 0.9}, now, effects).ok());
  flush();
  worked[session] = 20;
  work(session);
  EXPECT_EQ(status(job).state, JobState::done);
  EXPECT_EQ(status(job).reached, GoalLimit::error);
  EXPECT_EQ(status(job).min_tile_samples, status(job).max_tile_samples);
  EXPECT_EQ(next_error_count(status(job).min_tile_samples), status(job).min_tile_samples);
  EXPECT_LE(status(job).min_tile_samples, next_error_count(out));
  EXPECT_EQ(status(job).counters.results_duplicate, 0u);
}

TEST_F(ErrorGoalTest, TheEtaIsThatOfTheExpectedCount) {
  constexpr double kSpeed = 1e5;  // pixel samples per second
  const JobId job = submit(error_spec(0.01));
  const SessionId session = connect("w");
  for (std::size_t i = 0; i < got<LeaseGrant>(session).size() && status(job).min_tile_samples < 16; ++i) {
    const LeaseGrant grant = got<LeaseGrant>(session)[i];
    for (const TileId tile : grant.unit.tiles) {
      const double seconds = 64.0 * 64 * static_cast<double>(grant.unit.range.count()) / kSpeed;
      now += from_seconds(seconds);
      say(session, result(grant, tile, seconds));
    }
  }
  const JobStatus seen = status(job);
  ASSERT_EQ(seen.min_tile_samples, 16u);
  ASSERT_EQ(seen.max_tile_samples, 16u);
  // The error is 0.1221 at 16 samples. As 1/samples it is 0.01 at 196, so at 256.
  const double expected = 128.0 * 64 * (256 - 16) / kSpeed;
  EXPECT_NEAR(seen.eta_seconds, expected, 0.2 * expected);
}

TEST_F(ErrorGoalTest, UnmeasurableGoalsAreRefusedByName) {
  const auto error_of = [&](const JobSpec& job) {
    const Result<JobId> id = coordinator->submit(job, now, unix_ms(), effects);
    EXPECT_EQ(id.status().code(), StatusCode::kInvalidArgument);
    return message_of(id.status());
  };
  EXPECT_EQ(error_of(error_spec(-0.1)), "goal.error: must be finite and at least 1e-12, got -0.1");
  EXPECT_EQ(error_of(error_spec(NAN)), "goal.error: must be finite and at least 1e-12, got nan");
  JobSpec pixel = spec("r1", 4, {0, 0, 1, 1});
  pixel.goal.error = 0.1;
  EXPECT_EQ(error_of(pixel), "goal.error: a single pixel has no error estimate: give samples or seconds");
  JobSpec photons = error_spec(0.1);
  photons.settings.method = "photon-map:caustic";
  EXPECT_EQ(
      error_of(photons),
      "goal.error: method photon-map:caustic has no error estimate, because all its samples show the same photons: "
      "give samples or seconds");
}

}  // namespace
}  // namespace lightmill
