// Allocation of samples by a pilot, and its effect on counts and error.
#include "common/film/error_goal.h"
#include "tests/unit/server/pilot_fixture.h"

namespace lightmill::test {
namespace {

class AllocationTest : public PilotTest {
 protected:
  /// An adaptive job of two tiles, unless given another crop.
  JobId submit_adaptive(Goal goal, PixelRect crop = {0, 0, 128, 64}) {
    JobSpec job = spec("r1", 0, crop);
    job.goal = goal;
    job.goal.adaptive = true;
    const Result<JobId> id = coordinator->submit(job, now, unix_ms(), effects, {false, {}, {}, {"path"}});
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

TEST_F(AllocationTest, APilotDecidesTheSamplesOfEachTile) {
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
  EXPECT_FALSE(coordinator->extend(job, {.samples = 100}, now, effects).ok());
  ASSERT_TRUE(coordinator->extend(job, {.samples = 102}, now, effects).ok());
  flush();
  const SessionId b = connect("b");
  pass(limits.restart_grace + std::chrono::seconds(1));
  work(b);
  EXPECT_EQ(status(job).state, JobState::done);
  EXPECT_EQ(samples(job), (std::pair{std::uint64_t{51}, std::uint64_t{408}}));
}

TEST_F(AllocationTest, TheErrorIsReadWhenAllTilesHaveTheirParts) {
  first_extra = 16;
  const SessionId a = connect("a");
  const JobId job = submit_adaptive({.error = 0.02});
  allocate(a, {-2, 1});
  work(a);
  EXPECT_EQ(status(job).reached, GoalLimit::error);
  const auto [quiet, noisy] = samples(job);
  EXPECT_EQ(next_error_count(4 * quiet), 4 * quiet) << quiet;
  EXPECT_EQ(noisy, 8 * quiet);
  EXPECT_LE(status(job).error.rel_mse + status(job).error.half_width, 0.02);
}

TEST_F(AllocationTest, TheErrorIsNotReadBeforeTheQuietestTileHasItsFirstCount) {
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
    // No history is kept, either.
    ASSERT_EQ(status(job).history.size(), 1u);
    EXPECT_EQ(status(job).history[0].samples,
              static_cast<double>(status(job).samples_done) / coordinator->film(job)->grid().pixel_count());
  }
}

TEST_F(AllocationTest, TheErrorHistoryHasTwoPointsPerDoublingOfSamples) {
  constexpr int kTiles = 5;
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
  EXPECT_EQ(history.back().samples, (4 * 250 + 4000) / 5.0);
  // Each is a row of the store with the whole job.
  const auto rows = std::ranges::count_if(writes, [](const StoreOp& op) { return std::holds_alternative<PutJob>(op); });
  EXPECT_LE(static_cast<std::size_t>(rows), history.size() + 4) << "submitted, started, chosen, done";
  // A restarted coordinator continues the history.
  StoredState state{2, {{stored(), {}}}, 2};
  for (std::uint32_t tile = 0; tile < kTiles; ++tile) {
    for (const NodePtr& node : coordinator->film(job)->forest(TileId{tile})) {
      state.jobs[0].nodes.push_back({TileId{tile}, node});
    }
  }
  restart(std::move(state));
  ASSERT_TRUE(coordinator->extend(job, {.samples = 2000}, now, effects).ok());
  flush();
  const SessionId b = connect("b");
  pass(limits.restart_grace + std::chrono::seconds(1));
  work(b);
  EXPECT_EQ(status(job).state, JobState::done);
  EXPECT_LE(status(job).history.size(), history.size() + 3);  // 1024, 1536 and the end
}

TEST_F(AllocationTest, TheEtaOfAnErrorGoalUsesTheFramesCount) {
  first_extra = 16;
  const JobId job = submit_adaptive({.error = 0.0065});
  const SessionId a = connect("a");
  allocate(a, {-2, 1});
  const Film* const film = coordinator->film(job);
  constexpr double kSpeed = 1e6;  // pixel samples per second
  for (std::size_t i = 0; i < got<LeaseGrant>(a).size() && film->frame_samples() < 64; ++i) {
    const LeaseGrant grant = got<LeaseGrant>(a)[i];
    for (const TileId tile : grant.unit.tiles) {
      const double seconds = 64.0 * 64 * static_cast<double>(grant.unit.range.count()) / kSpeed;
      now += from_seconds(seconds);
      say(a, result(grant, tile, seconds));
    }
  }
  const JobStatus seen = status(job);
  ASSERT_EQ(seen.samples_done, (16u + 128) * 64 * 64);
  // Errors fall as 1/samples: from the error at 64 of the frame to the goal, with 9/8 a pixel.
  const double wanted = 64 * (seen.error.rel_mse + seen.error.half_width) / 0.0065;
  ASSERT_GT(wanted, 512);
  ASSERT_LT(wanted, 768);
  const double expected = (768 - 64) * 9.0 / 8 * 128 * 64 / kSpeed;
  EXPECT_NEAR(seen.eta_seconds, expected, 0.2 * expected);
}

TEST_F(AllocationTest, ReportedAllocationsAreChecked) {
  const SessionId a = connect("a");
  const JobId job = submit_adaptive({.samples = 8});
  allocate(a, {1});
  EXPECT_NE(stored().method_notes.candidates.size(), 0u) << "one of two tiles";
  allocate(a, {});
  EXPECT_TRUE(stored().allocation.even());
  work(a);
  EXPECT_EQ(samples(job), (std::pair{std::uint64_t{8}, std::uint64_t{8}}));
  // A job that asks for no allocation gets none.
  const JobId other = submit_undecided("r2");
  allocate(a, {1, 1});
  EXPECT_EQ(status(other).spec.settings.method, "auto");
  JobSpec most = spec("r3", kMaxSamples);
  most.goal.adaptive = true;
  EXPECT_EQ(message_of(coordinator->submit(most, now, unix_ms(), effects).status()),
            fmt::format("goal.samples: must be at most {}, got {}", kMaxSamples / 4, kMaxSamples));
}

TEST_F(AllocationTest, AnAllocationThatLeavesSamplesOutIsRefused) {
  for (const std::vector<std::int8_t>& too_few : {std::vector<std::int8_t>{-2, -2}, {-2, 0}, {0, -1}}) {
    restart({});
    const SessionId a = connect("a");
    const JobId job = submit_adaptive({.samples = 8});
    allocate(a, too_few);
    EXPECT_NE(stored().method_notes.candidates.size(), 0u) << "it would end with fewer samples than asked for";
    allocate(a, {0, 0});
    work(a);
    EXPECT_EQ(samples(job), (std::pair{std::uint64_t{8}, std::uint64_t{8}}));
  }
}

}  // namespace
}  // namespace lightmill::test
