// Health of a coordinator whose farm thread hangs.
#include "server/runtime/farm_pulse.h"

#include <gtest/gtest.h>

#include <atomic>
#include <future>

#include "server/api/health.h"
#include "server/store/sqlite/sqlite_store.h"
#include "tests/support/process.h"
#include "tests/support/temporary_folder.h"

namespace lightmill::test {
namespace {

TEST(FarmPulse, AHungFarmThreadIsNotServing) {
  const TemporaryFolder folder;
  Result<std::unique_ptr<Store>> store = open_sqlite_store(folder.path() / "farm.sqlite", {});
  ASSERT_TRUE(store.ok()) << store.status();
  Result<StoredState> state = (*store)->load();
  ASSERT_TRUE(state.ok()) << state.status();
  ActionLog actions({}, {});
  Coordinator farm({}, *std::move(state), system_clock().now());
  FarmLoop loop(farm, actions, **store, system_clock(), [](const Status&) {});
  std::atomic<bool> serving = false;
  Readiness readiness([&](bool ready) { serving = ready; });
  readiness.start(nullptr);
  ASSERT_TRUE(serving);
  std::promise<void> release;
  {
    FarmPulse pulse(
        loop, [&](bool beats) { readiness.set_moving(beats); }, std::chrono::milliseconds(300),
        std::chrono::milliseconds(10));
    std::promise<void> runs;
    loop.post_always([&runs](const FarmLoop::TaskContext&) { runs.set_value(); });
    runs.get_future().wait();
    EXPECT_TRUE(serving) << "a farm thread that works";
    loop.post_always([hang = release.get_future().share()](const FarmLoop::TaskContext&) { hang.wait(); });
    EXPECT_TRUE(eventually([&] { return !serving; }));
    release.set_value();
    EXPECT_TRUE(eventually([&] { return serving.load(); }));
  }
  EXPECT_TRUE(loop.stop().ok());
}

TEST(FarmPulse, EndsBesideAHungFarmThread) {
  const TemporaryFolder folder;
  Result<std::unique_ptr<Store>> store = open_sqlite_store(folder.path() / "farm.sqlite", {});
  ASSERT_TRUE(store.ok()) << store.status();
  Result<StoredState> state = (*store)->load();
  ASSERT_TRUE(state.ok()) << state.status();
  ActionLog actions({}, {});
  Coordinator farm({}, *std::move(state), system_clock().now());
  FarmLoop loop(farm, actions, **store, system_clock(), [](const Status&) {});
  std::promise<void> release;
  loop.post_always([hang = release.get_future().share()](const FarmLoop::TaskContext&) { hang.wait(); });
  {
    const FarmPulse pulse(loop, [](bool) {});
  }
  release.set_value();
  EXPECT_TRUE(loop.stop().ok());
}

}  // namespace
}  // namespace lightmill::test
