// Tests of the time of a job's last part if one worker is much slower than the others, in simulated time.
#include <gtest/gtest.h>

#include <algorithm>

#include "tests/simulation/farm_simulation.h"

namespace lightmill::simulation {
namespace {

constexpr std::uint64_t kSeeds = 20;
constexpr double kSlow = 20;

struct LastPart {
  double median_seconds = 0, most_seconds = 0;
  double job_seconds = 0;  ///< mean of whole jobs
};

LastPart last_part(const Race& race) {
  std::vector<double> seconds;
  LastPart last;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    const Report report = FarmSimulation(seed, race).run();
    EXPECT_EQ(report.failure, "") << "seed " << seed;
    seconds.push_back(report.last_part_seconds);
    last.job_seconds += report.job_seconds / kSeeds;
  }
  std::ranges::sort(seconds);
  last.median_seconds = seconds[seconds.size() / 2];
  last.most_seconds = seconds.back();
  return last;
}

enum class Straggler { slow, slow_from_the_middle_on, slow_near_the_end, hung_in_the_middle, hung_near_the_end };

/// Makes one of the race's four workers a straggler, from the start or later. `quiet`: the race without one.
Race with(Straggler straggler, Race race, const LastPart& quiet) {
  const bool late = straggler == Straggler::slow_near_the_end || straggler == Straggler::hung_near_the_end;
  race.change_after = (late ? 0.94 : 0.5) * quiet.job_seconds;
  switch (straggler) {
    case Straggler::slow:
      race.slowness.back() = kSlow;
      break;
    case Straggler::slow_from_the_middle_on:
    case Straggler::slow_near_the_end:
      race.slowness_then = kSlow;
      break;
    case Straggler::hung_in_the_middle:
    case Straggler::hung_near_the_end:
      race.hangs_then = true;
      break;
  }
  return race;
}

const char* name_of(Straggler straggler) {
  constexpr const char* kNames[] = {"Slow", "SlowFromTheMiddleOn", "SlowNearTheEnd", "HungInTheMiddle",
                                    "HungNearTheEnd"};
  return kNames[static_cast<std::size_t>(straggler)];
}
void PrintTo(Straggler straggler, std::ostream* out) {
  *out << name_of(straggler);
}

class Stragglers : public testing::TestWithParam<Straggler> {};

// Three workers do the work of four. This alone takes 4/3 of the time.
TEST_P(Stragglers, LengthenTheLastPartOfALongJobByAtMostHalf) {
  const Race race{.samples = 256};
  static const LastPart quiet = last_part(race);
  const LastPart last = last_part(with(GetParam(), race, quiet));
  fmt::print("a job of {:.0f} s: from 95 % to done {:.2f} s ({:.2f} at most) instead of {:.2f} s\n", quiet.job_seconds,
             last.median_seconds, last.most_seconds, quiet.median_seconds);
  EXPECT_LE(last.median_seconds, 1.5 * quiet.median_seconds);
  EXPECT_LE(last.most_seconds, 1.7 * quiet.median_seconds);
}

// A straggler has up to two seconds of work, at its earlier speed.
TEST_P(Stragglers, DelayAShortJobByLittleMoreThanAUnit) {
  const Race race{.tile_seconds = 0.005};
  static const LastPart quiet = last_part(race);
  const LastPart last = last_part(with(GetParam(), race, quiet));
  fmt::print("a job of {:.1f} s: from 95 % to done {:.2f} s ({:.2f} at most) instead of {:.2f} s\n", quiet.job_seconds,
             last.median_seconds, last.most_seconds, quiet.median_seconds);
  EXPECT_LE(last.median_seconds, 1.5 * quiet.median_seconds + 0.5);
  EXPECT_LE(last.most_seconds, 1.5 * quiet.median_seconds + 1);
}

// Everything is rendered twice, by two workers. Audits of a straggler move to others too. Three workers do the work of four. The
// straggler holds up to two seconds of results, and may later hold two seconds of audits.
TEST_P(Stragglers, DoNotDelayAudits) {
  const Race race{.samples = 128, .audit_share = 1};
  static const LastPart quiet = last_part(race);
  const LastPart last = last_part(with(GetParam(), race, quiet));
  fmt::print("a job of {:.0f} s, all audited: from 95 % to done {:.2f} s ({:.2f} at most) instead of {:.2f} s\n",
             quiet.job_seconds, last.median_seconds, last.most_seconds, quiet.median_seconds);
  EXPECT_LE(last.median_seconds, 4.0 / 3 * quiet.median_seconds + 2);
  EXPECT_LE(last.most_seconds, 4.0 / 3 * quiet.median_seconds + 4);
}

INSTANTIATE_TEST_SUITE_P(All, Stragglers,
                         testing::Values(Straggler::slow, Straggler::slow_from_the_middle_on,
                                         Straggler::slow_near_the_end, Straggler::hung_in_the_middle,
                                         Straggler::hung_near_the_end),
                         [](const auto& info) { return std::string(name_of(info.param)); });

}  // namespace
}  // namespace lightmill::simulation
