// Health of a coordinator whose farm thread hangs.
#include "server/runtime/farm_watchdog.h"

#include <gtest/gtest.h>

#include <atomic>
#include <future>

#include "server/api/health.h"
#include "server/store/sqlite/sqlite_store.h"
#include "tests/support/process.h"
#include "tests/support/temporary_folder.h"

namespace lightmill::test {
namespace {

/// A farm thread over an empty store.
class FarmWatchdogTest : public testing::Test {
 protected:
  /// Keeps the farm thread from everything else until `release_` has its value.
  void hang() {
    loop_.post_always([until = release_.get_future().share()](const FarmLoop::TaskContext&) { until.wait(); });
  }

  TemporaryFolder folder_;
  std::unique_ptr<Store> store_ = open_sqlite_store(folder_.path() / "farm.sqlite", {}).value();
  ActionLog actions_{{}, {}};
  Coordinator farm_{{}, store_->load().value(), system_clock().now()};
  FarmLoop loop_{farm_, actions_, *store_, system_clock(), [](const Status&) {}};
  std::promise<void> release_;
};

TEST_F(FarmWatchdogTest, AHungFarmThreadIsNotServing) {
  std::atomic<bool> serving = false;
  Readiness readiness([&](bool ready) { serving = ready; });
  readiness.start(nullptr);
  ASSERT_TRUE(serving);
  {
    FarmWatchdog watchdog(
        loop_, [&](bool answers) { readiness.set_moving(answers); }, std::chrono::milliseconds(300),
        std::chrono::milliseconds(10));
    std::promise<void> runs;
    loop_.post_always([&runs](const FarmLoop::TaskContext&) { runs.set_value(); });
    runs.get_future().wait();
    EXPECT_TRUE(eventually([&] { return serving.load(); })) << "a farm thread that works";
    hang();
    EXPECT_TRUE(eventually([&] { return !serving; }));
    release_.set_value();
    EXPECT_TRUE(eventually([&] { return serving.load(); }));
  }
  EXPECT_TRUE(loop_.stop().ok());
}

TEST_F(FarmWatchdogTest, EndsBesideAHungFarmThread) {
  hang();
  {
    const FarmWatchdog watchdog(loop_, [](bool) {});
  }
  release_.set_value();
  EXPECT_TRUE(loop_.stop().ok());
}

}  // namespace
}  // namespace lightmill::test
