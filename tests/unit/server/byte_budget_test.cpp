#include "server/web/byte_budget.h"

#include <gtest/gtest.h>

#include <thread>
#include <vector>

namespace lightmill {
namespace {

TEST(ByteBudget, IsNeverPassedAndWholeAgainWhenAllPlacesAreGiven) {
  constexpr std::uint64_t kMost = 100, kEach = 30;
  const ByteBudget budget(kMost);
  std::atomic<std::uint64_t> held = 0, most_held = 0, refused = 0;
  {
    std::vector<std::jthread> threads;
    for (int i = 0; i < 4; ++i) {
      threads.emplace_back([&] {
        for (int turn = 0; turn < 20'000; ++turn) {
          const ByteBudget::Place place = budget.take(kEach);
          if (place == nullptr) {
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
  EXPECT_LE(most_held, kMost);
  EXPECT_LT(refused, 80'000u);
  EXPECT_NE(budget.take(kMost), nullptr);
  EXPECT_EQ(budget.take(kMost + 1), nullptr);
}

TEST(CallersBudget, OneCallerTakesHalfAndAllTogetherNoMoreThanThereIs) {
  CallersBudget budget(100);
  ByteBudget::Place ada = budget.take_more("ada", nullptr, 30);
  ASSERT_NE(ada, nullptr);
  EXPECT_EQ(budget.take_more("ada", ada, 30), nullptr);
  ada = budget.take_more("ada", ada, 20);
  ASSERT_NE(ada, nullptr);
  EXPECT_EQ(budget.take_more("ada", ada, 1), nullptr);
  ByteBudget::Place bob = budget.take_more("bob", nullptr, 40);
  ASSERT_NE(bob, nullptr);
  EXPECT_EQ(budget.take_more("eve", nullptr, 20), nullptr) << "10 are left";
  EXPECT_NE(budget.take_more("eve", nullptr, 10), nullptr);
  ada.reset();
  EXPECT_NE(budget.take_more("bob", bob, 10), nullptr);
  EXPECT_NE(budget.take_more("ada", nullptr, 50), nullptr) << "all that it had is back";
}

}  // namespace
}  // namespace lightmill
