#include "server/web/byte_budget.h"

#include <gtest/gtest.h>

#include <thread>
#include <vector>

namespace lightmill {
namespace {

TEST(ByteBudget, IsNeverExceededAndIsWholeAgainAfterAllReturns) {
  constexpr std::uint64_t kMax = 100, kEach = 30;
  const ByteBudget budget(kMax);
  std::atomic<std::uint64_t> held = 0, most_held = 0, refused = 0;
  {
    std::vector<std::jthread> threads;
    for (int i = 0; i < 4; ++i) {
      threads.emplace_back([&] {
        for (int turn = 0; turn < 20'000; ++turn) {
          const ByteBudget::Reservation reservation = budget.take(kEach);
          if (reservation == nullptr) {
            ++refused;
            continue;
          }
          const std::uint64_t now = held += kEach;
          for (std::uint64_t most = most_held; now > most && !most_held.compare_exchange_weak(most, now);) {
          }
          held -= kEach;
        }
      });
    }
  }
  EXPECT_LE(most_held, kMax);
  EXPECT_LT(refused, 80'000u);
  EXPECT_NE(budget.take(kMax), nullptr);
  EXPECT_EQ(budget.take(kMax + 1), nullptr);
}

TEST(CallersBudget, OneCallerGetsHalfAndAllCallersGetTheWhole) {
  CallersBudget budget(100);
  const Holder ada{"ada", "10.0.0.1"}, bob{"bob", "10.0.0.2"}, eve{"eve", "10.0.0.3"};
  ByteBudget::Reservation of_ada = budget.take(ada, 30);
  ASSERT_NE(of_ada, nullptr);
  EXPECT_EQ(budget.take(ada, 30, of_ada), nullptr);
  of_ada = budget.take(ada, 20, of_ada);
  ASSERT_NE(of_ada, nullptr);
  EXPECT_EQ(budget.take(ada, 1, of_ada), nullptr);
  ByteBudget::Reservation of_bob = budget.take(bob, 40);
  ASSERT_NE(of_bob, nullptr);
  EXPECT_EQ(budget.take(eve, 20), nullptr) << "10 are left";
  EXPECT_NE(budget.take(eve, 10), nullptr);
  of_ada.reset();
  EXPECT_NE(budget.take(bob, 10, of_bob), nullptr);
  EXPECT_NE(budget.take(ada, 50), nullptr) << "it has returned everything";
}

TEST(CallersBudget, ManyNamesOfAnAddressOrAddressesOfANameGetHalf) {
  CallersBudget budget(100);
  const ByteBudget::Reservation first = budget.take({"ada", "10.0.0.1"}, 50);
  ASSERT_NE(first, nullptr);
  EXPECT_EQ(budget.take({"bob", "10.0.0.1"}, 1), nullptr);
  EXPECT_EQ(budget.take({"ada", "10.0.0.2"}, 1), nullptr);
  EXPECT_NE(budget.take({"bob", "10.0.0.2"}, 50), nullptr) << "a refusal takes nothing";
}

}  // namespace
}  // namespace lightmill
