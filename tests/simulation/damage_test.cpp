// Tests of damaged files: a farm is killed, its files are damaged, and another coordinator starts on them.
#include <gtest/gtest.h>
#include <spdlog/spdlog.h>

#include "tests/simulation/damages.h"

namespace lightmill::simulation {
namespace {

/// The log names the damage, so it is silenced.
class Silence {
 public:
  Silence() { spdlog::set_level(spdlog::level::off); }
  ~Silence() { spdlog::set_level(spdlog::level::info); }
};

class Damages : public testing::TestWithParam<std::uint64_t> {};

TEST_P(Damages, AreNeverSilentInAnyRowOrFile) {
  const Silence silence;
  DamageTable table;
  std::map<std::string, std::uint64_t> outcomes;
  for (std::uint64_t seed = 1; seed <= GetParam(); ++seed) {
    const DamageReport report = damage_one(seed);
    ASSERT_EQ(report.failure, "") << report.kind << ": replay it with simulate --damages 1 --first " << seed;
    table.add(report);
    ++outcomes[report.outcome];
  }
  fmt::print("{}", table.text());
  for (const char* const outcome : kDamageOutcomes) {
    EXPECT_GT(outcomes[outcome], GetParam() / 100) << outcome;
  }
}
INSTANTIATE_TEST_SUITE_P(Few, Damages, testing::Values(125), testing::PrintToStringParamName());
INSTANTIATE_TEST_SUITE_P(Many, Damages, testing::Values(500), testing::PrintToStringParamName());

TEST(ForgedDamages, AreFoundInTheFilms) {
  const Silence silence;
  std::uint64_t forged = 0, found = 0;
  for (std::uint64_t seed = 1; seed <= 64; ++seed) {
    const DamageReport report = damage_one(seed, true);
    forged += report.kind == "nodes: forged" ? 1 : 0;
    found += report.failure.ends_with("does not have the bits of the run without damage") ? 1 : 0;
  }
  EXPECT_GT(forged, 32u);
  EXPECT_EQ(found, forged);
}

}  // namespace
}  // namespace lightmill::simulation
