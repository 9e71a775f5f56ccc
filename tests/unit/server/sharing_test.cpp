// Shares of jobs of equal priority in a worker's time, and the length of its units.
#include <algorithm>
#include <deque>

#include "tests/unit/server/coordinator_fixture.h"

namespace lightmill::test {
namespace {

/// A worker of one thread, whose tiles take time on the test's clock.
class SharingTest : public CoordinatorTest {
 protected:
  struct Done {
    LeaseGrant grant;
    Time start, end;
  };
  /// A huge film whose upper eighth is empty and costs next to nothing.
  static constexpr std::int32_t kSide = 4096;
  static JobSpec huge() { return spec("huge", 1 << 16, {0, 0, kSide, kSide}); }
  static double cost_of_pixel_sample(const RenderSettings& job, TileId tile) {
    const std::int32_t rows = (job.crop.height + 63) / 64;
    const std::int32_t columns = (job.crop.width + 63) / 64;
    const bool empty = job.crop.width == kSide && static_cast<std::int32_t>(tile.value) / columns < rows / 8;
    return empty ? 2e-8 : 1e-5;
  }
  void take_new() {
    const std::vector<LeaseGrant> grants = got<LeaseGrant>(session);
    waiting.insert(waiting.end(), grants.begin() + static_cast<std::ptrdiff_t>(taken), grants.end());
    taken = grants.size();
  }
  /// Works until `until`, to the end of a unit.
  void work_until(Time until) {
    take_new();
    while (now < until && !waiting.empty()) {
      const LeaseGrant grant = waiting.front();
      waiting.pop_front();
      const Time start = now;
      const RenderSettings& job = (*coordinator->spec(grant.unit.job))->settings;
      for (const TileId tile : grant.unit.tiles) {
        WorkerResult done = result(grant, tile);
        const double samples = static_cast<double>(done.node.values.size()) / 6 * grant.unit.range.count();
        done.seconds = samples * cost_of_pixel_sample(job, tile);
        now += std::chrono::duration_cast<Duration>(std::chrono::duration<double>(done.seconds));
        say(session, std::move(done));
        writes.clear();
      }
      units.push_back({grant, start, now});
      take_new();
    }
  }
  double seconds_of(JobId job, Time from) const {
    double sum = 0;
    for (const Done& unit : units) {
      sum += unit.grant.unit.job == job && unit.start >= from ? to_seconds(unit.end - unit.start) : 0;
    }
    return sum;
  }
  double longest_unit() const {
    double longest = 0;
    for (const Done& unit : units) {
      longest = std::max(longest, to_seconds(unit.end - unit.start));
    }
    return longest;
  }

  SessionId session;
  std::deque<LeaseGrant> waiting;
  std::size_t taken = 0;
  std::vector<Done> units;
};

TEST_F(SharingTest, NoUnitOfAHugeFilmIsMuchLongerThanTheAim) {
  submit(huge());
  session = connect("w");
  work_until(now + std::chrono::seconds(30));
  EXPECT_GT(units.size(), 20u);
  EXPECT_LT(units.size(), 120u);  // nor are they tiny
  EXPECT_LE(longest_unit(), 2 * limits.unit_seconds);
}

TEST_F(SharingTest, ASmallJobGetsItsShareBesideAHugeOne) {
  const JobId big = submit(huge());
  session = connect("w");
  work_until(now + std::chrono::seconds(3));
  const Time submitted = now;
  const JobId small = submit(spec("small", 1 << 12, {0, 0, 200, 160}));
  work_until(submitted + std::chrono::seconds(40));

  const auto first =
      std::find_if(units.begin(), units.end(), [&](const Done& unit) { return unit.grant.unit.job == small; });
  ASSERT_NE(first, units.end());
  EXPECT_LE(to_seconds(first->start - submitted), 2 * limits.unit_seconds);
  EXPECT_GE(coordinator->film(small)->min_samples(), 1u);
  EXPECT_NEAR(seconds_of(small, first->start), seconds_of(big, first->start), 2 * limits.unit_seconds);
}

TEST_F(SharingTest, APausedJobFreesTheWorkerSoon) {
  const JobId big = submit(huge());
  session = connect("w");
  work_until(now + std::chrono::seconds(3));
  ASSERT_TRUE(coordinator->pause(big, now, effects).ok());
  flush();
  const Time paused = now;
  work_until(now + std::chrono::seconds(60));
  EXPECT_TRUE(waiting.empty());
  EXPECT_LE(to_seconds(now - paused), 2 * limits.unit_seconds);
}

}  // namespace
}  // namespace lightmill::test
