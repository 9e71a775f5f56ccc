// Tests of each attack, one at a time.
#include "tests/simulation/attacks.h"

#include <gtest/gtest.h>

namespace lightmill::simulation {
namespace {

TEST(Attacks, LeaveNoWrongPixelUnnoticed) {
  constexpr std::uint64_t kFarms = 60;
  const AttackTable table = try_attacks(kFarms);
  fmt::print("{}", table.text());
  for (const AttackTable::Row& row : table.rows) {
    EXPECT_EQ(row.unnoticed, 0u) << row.attack << ": " << row.failure;
    EXPECT_GT(row.attacked, kFarms / 4) << row.attack;
  }
}

}  // namespace
}  // namespace lightmill::simulation
