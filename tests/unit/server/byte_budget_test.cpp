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
          ByteBudget::Place place = budget.take(kEach / 2);
          ByteBudget::Place more = place != nullptr ? budget.take_more(place, kEach / 2) : nullptr;
          place.reset();
          if (more == nullptr) {
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

}  // namespace
}  // namespace lightmill
