#include "server/scheduling/job_plan.h"

#include <gtest/gtest.h>

#include <random>

namespace lightmill {
namespace {

constexpr JobId kJob{1};
constexpr std::uint64_t kPlenty = std::uint64_t{1} << 40;
/// A worker so fast that only the film bounds its units.
constexpr UnitAim kFast{.unit_seconds = 1, .seconds_per_pixel_sample = 1e-12, .threads = 1, .farm_threads = 1};

NodePtr make_node(const Film& film, TileId tile, SampleRange range) {
  return std::make_shared<const Node>(
      Node{range, std::vector<float>(film.expected_values(tile, range), static_cast<float>(range.count())), 0});
}

class JobPlanTest : public testing::Test {
 protected:
  std::optional<Unit> take(JobPlan& plan, const UnitAim& aim = kFast) {
    return plan.take(kJob, LeaseId{++last_lease}, aim);
  }
  void finish(JobPlan& plan, const Unit& unit) {
    for (const TileId tile : unit.tiles) {
      film.merge(tile, make_node(film, tile, unit.range));
      plan.settle(tile, unit.range);
    }
  }
  /// Takes and finishes all units, one after another.
  std::vector<Unit> work_off(JobPlan& plan, const UnitAim& aim = kFast) {
    std::vector<Unit> units;
    while (std::optional<Unit> unit = take(plan, aim)) {
      finish(plan, *unit);
      units.push_back(*std::move(unit));
    }
    return units;
  }

  Film film{TileGrid({0, 0, 256, 64}), 3};  // four tiles
  std::uint64_t last_lease = 0;
};

TEST_F(JobPlanTest, RangesOfATileDoubleAndEndAtTheGoal) {
  JobPlan plan(film, 100, kPlenty);
  std::vector<SampleRange> ranges;
  for (const Unit& unit : work_off(plan)) {
    EXPECT_EQ(unit.tiles.size(), 4u);
    ranges.push_back(unit.range);
  }
  EXPECT_EQ(ranges,
            (std::vector<SampleRange>{{0, 0}, {0, 1}, {1, 1}, {2, 1}, {3, 1}, {4, 1}, {5, 1}, {5, 2}, {2, 24}}));
  EXPECT_EQ(film.min_samples(), 100u);
}

TEST_F(JobPlanTest, AnExtendedJobResumesWhereItEnded) {
  JobPlan plan(film, 100, kPlenty);
  work_off(plan);
  EXPECT_FALSE(plan.has_work());
  plan.set_goal(300);
  const std::vector<Unit> more = work_off(plan);
  EXPECT_EQ(more.front().range, (SampleRange{2, 25}));  // [100, 104): no more is aligned
  EXPECT_EQ(film.min_samples(), 300u);
}

TEST_F(JobPlanTest, NoSampleIsGivenTwice) {
  JobPlan plan(film, 64, kPlenty);
  std::set<std::pair<TileId, std::uint64_t>> given;  // (tile, sample)
  while (const std::optional<Unit> unit = take(plan)) {
    for (const TileId tile : unit->tiles) {
      for (std::uint64_t i = unit->range.first(); i < unit->range.end(); ++i) {
        EXPECT_TRUE(given.emplace(tile, i).second);
      }
    }
  }
  EXPECT_EQ(given.size(), 4u * 64);
  EXPECT_EQ(plan.out_pixel_samples(), 4u * 64 * 4096);
}

TEST_F(JobPlanTest, LostRangesAreGivenNext) {
  JobPlan plan(film, 64, kPlenty);
  const Unit first = *take(plan);
  const Unit second = *take(plan);
  finish(plan, second);
  plan.release(LeaseId{1}, first.tiles[2], first.range);
  const Unit again = *take(plan);
  EXPECT_EQ(again.range, first.range);
  EXPECT_EQ(again.tiles, std::vector<TileId>{first.tiles[2]});
}

TEST_F(JobPlanTest, ARestartRebuildsThePlanFromTheFilm) {
  for (std::uint32_t seed = 0; seed < 30; ++seed) {
    std::mt19937 bits(seed);
    film = Film(TileGrid({0, 0, 256, 64}), 3);
    {
      JobPlan plan(film, 100, kPlenty);
      for (int i = 0; i < 20; ++i) {
        const std::optional<Unit> unit = take(plan);
        if (unit && bits() % 3 != 0) {
          finish(plan, *unit);  // the others are leased when the coordinator dies
        }
      }
    }
    JobPlan plan(film, 100, kPlenty);
    for (const Unit& unit : work_off(plan)) {
      EXPECT_LE(unit.range.end(), 100u);
    }
    EXPECT_EQ(film.min_samples(), 100u) << "seed " << seed;
    EXPECT_EQ(film.max_samples(), 100u) << "seed " << seed;
  }
}

TEST_F(JobPlanTest, PendingRangesAreBoundedButNeverStuck) {
  JobPlan plan(film, 1 << 20, 1);  // a budget of one byte: four nodes per tile
  const Unit stuck = *take(plan);  // [0, 1) of all tiles, which never finishes
  std::uint64_t given = 0;
  while (const std::optional<Unit> unit = take(plan)) {
    finish(plan, *unit);
    ASSERT_LT(++given, 1000u);
  }
  for (const TileId tile : stuck.tiles) {
    EXPECT_LE(film.forest(tile).size() + 1, 4u);
  }
  finish(plan, stuck);
  EXPECT_TRUE(plan.has_work());
}

TEST_F(JobPlanTest, ALostRangeIsGivenAtAnyBudget) {
  JobPlan plan(film, 1 << 20, 1);
  const Unit stuck = *take(plan);
  while (const std::optional<Unit> unit = take(plan)) {
    finish(plan, *unit);
  }
  for (const TileId tile : stuck.tiles) {
    plan.release(LeaseId{1}, tile, stuck.range);
  }
  const std::optional<Unit> again = take(plan);
  ASSERT_TRUE(again);
  EXPECT_EQ(again->range, stuck.range);
}

TEST_F(JobPlanTest, AClosedPlanOnlyFillsGaps) {
  JobPlan plan(film, kMaxSamples, kPlenty);
  const Unit first = *take(plan);
  const Unit second = *take(plan);
  finish(plan, second);
  plan.close();
  EXPECT_FALSE(plan.has_work());  // the missing ranges are leased
  EXPECT_FALSE(plan.nothing_out());
  plan.release(LeaseId{1}, first.tiles[0], first.range);
  const Unit again = *take(plan);
  EXPECT_EQ(again.range, first.range);
  finish(plan, again);
  for (std::size_t i = 1; i < first.tiles.size(); ++i) {
    film.merge(first.tiles[i], make_node(film, first.tiles[i], first.range));
    plan.settle(first.tiles[i], first.range);
  }
  EXPECT_FALSE(plan.has_work());
  EXPECT_TRUE(plan.nothing_out());
  EXPECT_EQ(film.min_samples(), 2u);
}

TEST_F(JobPlanTest, AClosedPlanGivesEveryTileOnlyItsFirstSample) {
  JobPlan plan(film, kMaxSamples, kPlenty);
  const Unit first = *take(plan);
  plan.close();
  for (const TileId tile : first.tiles) {
    plan.release(LeaseId{1}, tile, first.range);
  }
  while (const std::optional<Unit> unit = take(plan)) {
    EXPECT_EQ(unit->range, (SampleRange{0, 0}));
    finish(plan, *unit);
  }
  EXPECT_TRUE(plan.nothing_out());
  EXPECT_EQ(film.min_samples(), 1u);
  EXPECT_EQ(film.max_samples(), 1u);
}

TEST_F(JobPlanTest, RangesHeldByAWorkerAreAdopted) {
  JobPlan plan(film, 64, kPlenty);
  EXPECT_TRUE(plan.adopt(LeaseId{7}, TileId{1}, {3, 1}));   // [8, 16)
  EXPECT_FALSE(plan.adopt(LeaseId{8}, TileId{1}, {2, 3}));  // [12, 16) lies in it
  EXPECT_FALSE(plan.adopt(LeaseId{8}, TileId{1}, {6, 1}));  // beyond the goal
  EXPECT_FALSE(plan.adopt(LeaseId{8}, TileId{4}, {0, 0}));  // no such tile
  std::uint64_t given = 0;
  while (const std::optional<Unit> unit = take(plan)) {
    for (const TileId tile : unit->tiles) {
      EXPECT_FALSE(tile == TileId{1} && unit->range.first() < 16 && unit->range.end() > 8);
      given += unit->range.count();
    }
  }
  EXPECT_EQ(given, 4u * 64 - 8);
}

TEST(JobPlan, TheNextUnitAlwaysBeginsAtTheFirstFreeSample) {
  constexpr std::uint64_t kGoal = 3000;
  Film film(TileGrid({0, 0, 8, 8}), 3);
  JobPlan plan(film, kGoal, kPlenty);
  enum class Sample : char { free, out, merged };
  std::vector<Sample> samples(kGoal, Sample::free);
  const auto set = [&](SampleRange range, Sample to) {
    std::fill(samples.begin() + static_cast<std::ptrdiff_t>(range.first()),
              samples.begin() + static_cast<std::ptrdiff_t>(range.end()), to);
  };
  std::vector<std::pair<LeaseId, SampleRange>> out;
  std::mt19937 random(1);
  int taken = 0, given_back = 0;
  for (std::uint64_t lease = 1; plan.has_work() || !out.empty(); ++lease) {
    if (plan.has_work() && (out.size() < 20 || random() % 2 == 0)) {
      UnitAim aim = kFast;
      aim.seconds_per_pixel_sample = 1e-3;  // up to 8 samples of all 64 pixels
      aim.unit_seconds *= std::ldexp(1, -static_cast<int>(random() % 8));
      const Unit unit = *plan.take(kJob, LeaseId{lease}, aim);
      ASSERT_EQ(unit.tiles.size(), 1u);
      const auto first = std::ranges::find(samples, Sample::free) - samples.begin();
      ASSERT_EQ(unit.range.first(), static_cast<std::uint64_t>(first));
      ASSERT_TRUE(std::all_of(samples.begin() + first, samples.begin() + static_cast<std::ptrdiff_t>(unit.range.end()),
                              [](Sample sample) { return sample == Sample::free; }));
      set(unit.range, Sample::out);
      out.emplace_back(LeaseId{lease}, unit.range);
      ++taken;
    } else {
      const auto at = out.begin() + static_cast<std::ptrdiff_t>(random() % out.size());
      const auto [id, range] = *at;
      out.erase(at);
      if (random() % 4 == 0) {
        plan.release(id, TileId{0}, range);
        set(range, Sample::free);
        ++given_back;
      } else {
        film.merge(TileId{0}, make_node(film, TileId{0}, range));
        const std::vector<JobPlan::Hold> ended = plan.settle(TileId{0}, range);
        ASSERT_EQ(ended.size(), 1u);
        ASSERT_EQ(ended[0].lease, id);
        set(range, Sample::merged);
      }
    }
    ASSERT_EQ(plan.out_pixel_samples(), 64u * static_cast<std::uint64_t>(std::ranges::count(samples, Sample::out)));
    ASSERT_EQ(plan.free_pixel_samples(), 64u * static_cast<std::uint64_t>(std::ranges::count(samples, Sample::free)));
  }
  EXPECT_EQ(film.samples(TileId{0}), kGoal);
  EXPECT_GT(taken, 100);
  EXPECT_GT(given_back, 20);
}

TEST_F(JobPlanTest, ALeaseHoldsARangeOnceAndAFinishedRangeNamesItsLeases) {
  JobPlan plan(film, 4, kPlenty);
  const Unit unit = *take(plan);
  EXPECT_TRUE(plan.add_copy(LeaseId{50}, TileId{0}, unit.range));
  EXPECT_FALSE(plan.add_copy(LeaseId{50}, TileId{0}, unit.range));
  EXPECT_TRUE(std::ranges::equal(plan.holders(TileId{0}, unit.range), std::vector{LeaseId{1}, LeaseId{50}}));
  plan.release(LeaseId{1}, TileId{0}, unit.range);
  film.merge(TileId{0}, make_node(film, TileId{0}, unit.range));
  const std::vector<JobPlan::Hold> ended = plan.settle(TileId{0}, unit.range);
  ASSERT_EQ(ended.size(), 1u);
  EXPECT_EQ(ended[0].lease, LeaseId{50});
}

TEST(UnitSize, UnknownCostMeansOneSample) {
  const UnitAim aim{.unit_seconds = 1, .seconds_per_pixel_sample = 0, .threads = 2, .farm_threads = 2};
  EXPECT_EQ(choose_range({64, 128}, 64, 4096, 0, aim), (SampleRange{0, 64}));
  EXPECT_EQ(choose_tile_count({0, 64}, 64, 4096, aim), 8u);
  UnitAim large = aim;
  large.results_seconds = 0.5;
  EXPECT_EQ(choose_tile_count({0, 64}, 64, 4096, large), 2u) << "all its threads together send enough";
}

TEST(UnitSize, ATileTakesAtMostAUnitsTimeOfOneThread) {
  // 4096 pixels at 1 µs: 4 ms a sample; 128 samples are half a second, 256 a second and a bit.
  const UnitAim aim{.unit_seconds = 1, .seconds_per_pixel_sample = 1e-6, .threads = 2, .farm_threads = 2};
  EXPECT_EQ(choose_range({1024, 4096}, 64, 4096, 0, aim).count(), 128u);
  EXPECT_EQ(choose_tile_count({7, 8}, 64, 4096, aim), 3u);  // 2 threads × 1 s / 0.52 s
}

TEST(UnitSize, AllThreadsOfTheFarmFindWork) {
  // Two tiles and 32 threads: the last 128 samples are cut into 128 pieces, the shortest that are worth it.
  const UnitAim aim{.unit_seconds = 1, .seconds_per_pixel_sample = 1e-5, .threads = 8, .farm_threads = 32};
  const SampleRange range = choose_range({128, 256}, 2, 4096, 0, aim);
  EXPECT_EQ(2 * 128 / range.count(), 128u);
  EXPECT_EQ(choose_tile_count(range, 2, 4096, aim), 1u);
  // The samples behind them are work, too. With 127 pieces of 16 samples (0.66 s) left they are cut, with 128 they are
  // not.
  EXPECT_EQ(choose_range({128, 256}, 2, 4096, 128 * 16 * 4096 - 1, aim).count(), 8u);
  EXPECT_EQ(choose_range({128, 256}, 2, 4096, 128 * 16 * 4096, aim).count(), 16u);
}

TEST(UnitSize, LargerFarmsGetLongerUnits) {
  // A node of 96 KiB costs what 118 KiB do: 1,000 threads that send one each are 115.2 MiB.
  UnitAim aim{.seconds_per_pixel_sample = 1e-6, .threads = 1, .farm_threads = 1000};
  set_times(1, 96 * 1024, 115.234375 * 1024 * 1024, aim);
  EXPECT_DOUBLE_EQ(aim.least_seconds, 1);
  EXPECT_DOUBLE_EQ(aim.unit_seconds, 2);
  // 4 ms a sample and tile: with ranges of 244 samples all threads send 115 MiB a second. So 256 are not too short.
  EXPECT_EQ(choose_range({4096, 1 << 20}, 64, 4096, 1ull << 50, aim).count(), 256u);
  EXPECT_EQ(choose_range({4096, 1 << 20}, 64, 4096, 0, aim).count(), 256u) << "not cut any further";
  aim.farm_threads = 20;
  set_times(1, 96 * 1024, 115.234375 * 1024 * 1024, aim);
  EXPECT_DOUBLE_EQ(aim.least_seconds, 0.03) << "20 ms are enough for the results, but not worth a lease";
  EXPECT_DOUBLE_EQ(aim.unit_seconds, 1);
}

TEST(UnitSize, TheFirstSamplesFillTheTimeThatResultsTake) {
  // 4 ms a sample and tile.
  UnitAim aim{.seconds_per_pixel_sample = 1e-6, .threads = 1, .farm_threads = 10};
  const auto first_with = [&](double results_seconds) {
    aim.results_seconds = results_seconds;
    return choose_range({0, 1000}, 64, 4096, 0, aim);
  };
  EXPECT_EQ(first_with(0), (SampleRange{0, 0}));
  EXPECT_EQ(first_with(0.005), (SampleRange{0, 0}));
  EXPECT_EQ(first_with(0.020), (SampleRange{2, 0})) << "four take 16 ms";
  EXPECT_EQ(first_with(1), (SampleRange{4, 0})) << "sixteen at most";
  EXPECT_EQ(choose_range({0, 5}, 64, 4096, 0, aim), (SampleRange{2, 0})) << "or all that are left";
  aim.unit_seconds = 0.01;
  EXPECT_EQ(first_with(1), (SampleRange{1, 0})) << "or the most that its worker may hold";
  aim.unit_seconds = 1;
  aim.farm_threads = 640;
  EXPECT_EQ(first_with(0.2), (SampleRange{2, 0})) << "64 tiles have 64 results, a tenth of all threads'";
  aim.seconds_per_pixel_sample = 0;
  EXPECT_EQ(first_with(1), (SampleRange{0, 0})) << "its cost is unknown";
  aim.farm_threads = 1000;
  set_times(1, 96 * 1024, 115.234375 * 1024 * 1024, aim);
  EXPECT_DOUBLE_EQ(aim.results_seconds, 1);
}

TEST(UnitSize, SharedSamplesMakeUnitsOfManyTilesAndFewSamples) {
  // 64 tiles at 4 ms a sample: two threads take 0.13 s for a sample of the frame. So 4 samples fit a unit, and 8 fit
  // twice the time. Each of four such workers takes a quarter of the frame and four times the samples.
  UnitAim aim{.unit_seconds = 1, .seconds_per_pixel_sample = 1e-6, .threads = 2, .farm_threads = 2};
  aim.shared_samples = 32;
  EXPECT_EQ(choose_range({1024, 4096}, 64, 4096, 0, aim).count(), 4u);
  EXPECT_EQ(choose_tile_count({2, 256}, 64, 4096, aim), 64u);
  aim.unit_seconds = 2;
  EXPECT_EQ(choose_range({1024, 4096}, 64, 4096, 0, aim).count(), 8u);
  aim.unit_seconds = 1;
  aim.farm_threads = 8;
  EXPECT_EQ(choose_range({1024, 4096}, 64, 4096, 0, aim).count(), 16u);
  EXPECT_EQ(choose_tile_count({4, 64}, 64, 4096, aim), 16u);
  // Even of quick tiles, ranges are no longer than what a worker holds.
  aim.seconds_per_pixel_sample = 1e-9;
  EXPECT_EQ(choose_range({1024, 4096}, 64, 4096, 0, aim).count(), 32u);
  aim.shared_samples = 5;
  EXPECT_EQ(choose_range({1024, 4096}, 64, 4096, 0, aim).count(), 4u);
}

TEST(UnitSize, ARoundIsSharedByThreads) {
  const UnitAim aim{.unit_seconds = 1, .seconds_per_pixel_sample = 1e-9, .threads = 2, .farm_threads = 8};
  EXPECT_EQ(choose_tile_count({0, 0}, 64, 4096, aim), 16u);
  EXPECT_EQ(choose_tile_count({0, 0}, 3, 4096, aim), 1u);
}

TEST(UnevenJobPlan, TilesHaveTheirPartsAndAdvanceTogether) {
  Film film(TileGrid({0, 0, 256, 64}), 3, Allocation::of({-2, 0, 0, 2}).value());
  JobPlan plan(film, 64, kPlenty);
  EXPECT_EQ(plan.goal_of(TileId{0}), 16u);
  EXPECT_EQ(plan.goal_of(TileId{3}), 256u);
  std::set<TileId> first;
  for (std::uint64_t lease = 1;; ++lease) {
    ASSERT_EQ(plan.first_round(), first.size() < 4) << "once the plan has been asked";
    const std::optional<Unit> unit = plan.take(kJob, LeaseId{lease}, kFast);
    if (!unit) {
      break;
    }
    // A unit begins at the part of the frame that the other tiles have.
    const std::uint64_t frame = film.allocation().of_frame(unit->tiles[0], unit->range.first());
    for (std::uint32_t i = 0; i < 4; ++i) {
      EXPECT_LE(frame, film.allocation().of_frame(TileId{i}, film.samples(TileId{i})));
    }
    for (const TileId tile : unit->tiles) {
      first.insert(tile);
      film.merge(tile, make_node(film, tile, unit->range));
      plan.settle(tile, unit->range);
    }
    plan.has_work();
  }
  EXPECT_EQ(first.size(), 4u);
  EXPECT_TRUE(film.has_exactly(64));
  EXPECT_FALSE(plan.adopt(LeaseId{99}, TileId{0}, {4, 1})) << "beyond its part";
  plan.set_goal(65);
  EXPECT_TRUE(plan.adopt(LeaseId{99}, TileId{0}, {0, 16}));
  EXPECT_EQ(plan.out_end(), 65u) << "of the frame";
}

}  // namespace
}  // namespace lightmill
