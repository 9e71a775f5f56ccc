// Calls to a farm that can be cancelled. A wait without cancellation ends after a minute.
#include "client/cli/async_call.h"

#include <gtest/gtest.h>

#include <atomic>
#include <semaphore>

namespace lightmill::cli {
namespace {

constexpr auto kHang = std::chrono::minutes(1);

TEST(AsyncCall, DestructionCancelsTheRunningCall) {
  std::counting_semaphore<> heard(0);
  std::atomic<bool> cancelled = false;
  {
    const AsyncCall<int> looking(
        [&]() -> Result<int> {
          cancelled = heard.try_acquire_for(kHang);
          return 1;
        },
        [&] { heard.release(); });
  }
  EXPECT_TRUE(cancelled);
}

TEST(AsyncCall, ACallThatStartsAfterCancellationIsCancelled) {
  std::counting_semaphore<> heard(0);
  std::atomic<int> cancelled = 0;
  {
    const AsyncCall<int> looking(
        [&]() -> Result<int> {
          while (cancelled < 3 && heard.try_acquire_for(kHang)) {
            ++cancelled;
          }
          return 1;
        },
        [&] { heard.release(); });
  }
  EXPECT_EQ(cancelled, 3);
}

TEST(AsyncCall, ATakenAnswerIsNotCancelled) {
  bool cancelled = false;
  {
    AsyncCall<int> looking([] { return Result<int>(7); }, [&] { cancelled = true; });
    ASSERT_TRUE(looking.done(kHang));
    EXPECT_EQ(looking.result().value(), 7);
  }
  EXPECT_FALSE(cancelled);
}

}  // namespace
}  // namespace lightmill::cli
