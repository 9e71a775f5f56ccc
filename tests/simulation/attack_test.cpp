// Tests of each attack, one at a time.
#include "tests/simulation/attacks.h"

#include <gtest/gtest.h>

namespace lightmill::simulation {
namespace {

class Attacks : public testing::TestWithParam<std::uint64_t> {};

TEST_P(Attacks, LeaveNoWrongPixelUnnoticed) {
  const AttackTable table = try_attacks(GetParam());
  fmt::print("{}", table.text());
  for (const AttackTable::Row& row : table.rows) {
    EXPECT_EQ(row.unnoticed, 0u) << row.attack << ": " << row.failure;
    EXPECT_GT(row.attacked, GetParam() / 4) << row.attack;
  }
}
INSTANTIATE_TEST_SUITE_P(Few, Attacks, testing::Values(20), testing::PrintToStringParamName());
INSTANTIATE_TEST_SUITE_P(Many, Attacks, testing::Values(60), testing::PrintToStringParamName());

/// Coordinator without the defence against an attack.
struct Defenceless {
  const char* name;
  Attack attack;
  bool PlantedBugs::*bug;

  friend void PrintTo(const Defenceless& each, std::ostream* out) { *out << each.name; }
};
class AttackCheck : public testing::TestWithParam<Defenceless> {};

TEST_P(AttackCheck, FindsACoordinatorWithoutTheDefence) {
  PlantedBugs bugs;
  bugs.*GetParam().bug = true;
  constexpr std::uint64_t kFarms = 15;
  const AttackTable::Row row = try_attack(GetParam().attack, kFarms, bugs);
  EXPECT_GT(row.unnoticed, 0u) << "the check has no failure on " << kFarms << " farms";
}
INSTANTIATE_TEST_SUITE_P(
    All, AttackCheck,
    testing::Values(Defenceless{"WrongSums", Attack::wrong_sums, &PlantedBugs::repeat_results},
                    Defenceless{"SomeWrongSums", Attack::some_wrong_sums, &PlantedBugs::repeat_results},
                    Defenceless{"TwoNames", Attack::two_names, &PlantedBugs::trust_claims},
                    Defenceless{"Claims", Attack::claims, &PlantedBugs::trust_claims},
                    Defenceless{"Ungranted", Attack::ungranted, &PlantedBugs::ignore_grants},
                    Defenceless{"Garbage", Attack::garbage, &PlantedBugs::trust_hashes},
                    Defenceless{"Idle", Attack::idle, &PlantedBugs::wait_for_the_idle},
                    Defenceless{"Losses", Attack::losses, &PlantedBugs::believe_one_refusal},
                    Defenceless{"SecondIdentity", Attack::second_identity, &PlantedBugs::repeat_after_quarantine},
                    Defenceless{"Spite", Attack::spite, &PlantedBugs::believe_one_refusal}),
    [](const auto& info) { return std::string(info.param.name); });

}  // namespace
}  // namespace lightmill::simulation
