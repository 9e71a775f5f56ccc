// Render threads, whose sharing must not change a bit.
#include "worker/render/render_pool.h"

#include <gtest/gtest.h>

#include <future>
#include <semaphore>

#include "common/methods/spec/method_spec.h"
#include "tests/support/paths.h"
#include "tests/support/render_document.h"

namespace lightmill {
namespace {

constexpr std::uint32_t kThreads = 4;
constexpr int kSide = 96;  ///< pixels: four tiles, three of them smaller

/// Nodes by ticket, in order of arrival.
class Collected {
 public:
  void add(RenderedTile tile) {
    const MutexLock lock(mutex_);
    nodes_.insert_or_assign(tile.ticket, std::move(tile.node));
    changed_.notify_one();
  }
  std::map<std::uint64_t, Node> wait_for(std::size_t count) {
    const MutexLock lock(mutex_);
    while (nodes_.size() < count) {
      changed_.wait(mutex_);
    }
    return nodes_;
  }

 private:
  Mutex mutex_;
  CondVar changed_;
  std::map<std::uint64_t, Node> nodes_ LM_GUARDED_BY(mutex_);
};

std::vector<RenderTask> tasks_of(const std::shared_ptr<const Method>& method) {
  std::vector<RenderTask> tasks;
  for (std::uint32_t index = 0; index < 3; ++index) {  // 2 samples each: passes that several tiles need
    for (const PixelRect& rect :
         {PixelRect{0, 0, 64, 64}, PixelRect{64, 0, 32, 64}, PixelRect{0, 64, 64, 32}, PixelRect{64, 64, 32, 32}}) {
      tasks.push_back({tasks.size(), {1, index}, rect, method});
    }
  }
  return tasks;
}

class RenderPoolTest : public testing::TestWithParam<const char*> {};

TEST_P(RenderPoolTest, ThreadsThatShareAMethodRenderTheBitsOfOneThread) {
  const test::TestScene scene =
      test::TestScene(test::source_file("scenes/cornell-bench-balls.json")).resized(kSide, kSide);
  const MethodSettings settings{.name = GetParam(), .seed = 5};
  const auto make = [&] {
    Result<std::unique_ptr<Method>> method = make_method(scene.compiled(), settings);
    EXPECT_TRUE(method.ok()) << method.status();
    return std::shared_ptr<const Method>(std::move(method).value());
  };
  const std::vector<RenderTask> tasks = tasks_of(make());
  Collected collected;
  RenderPool pool(kThreads, [&](RenderedTile tile) { collected.add(std::move(tile)); });
  for (const RenderTask& task : tasks) {
    pool.add(task);
  }
  const std::map<std::uint64_t, Node> nodes = collected.wait_for(tasks.size());
  const std::shared_ptr<const Method> alone = make();
  const std::unique_ptr<Workspace> workspace = alone->make_workspace();
  for (const RenderTask& task : tasks) {
    EXPECT_EQ(hash_of(nodes.at(task.ticket)), hash_of(alone->render(task.rect, task.range, *workspace)))
        << "tile at " << task.rect.x << ", " << task.rect.y << ", from sample " << task.range.first();
  }
}
INSTANTIATE_TEST_SUITE_P(Methods, RenderPoolTest,
                         testing::Values("path", "caustic", "vcm", "ppm", "whitted", "preview"),
                         [](const auto& info) { return std::string(info.param); });

std::shared_ptr<const Method> path_method() {
  static const test::TestScene scene =
      test::TestScene(test::source_file("scenes/cornell-bench-balls.json")).resized(kSide, kSide);
  Result<std::unique_ptr<Method>> made = make_method(scene.compiled(), {.name = "path"});
  EXPECT_TRUE(made.ok()) << made.status();
  return std::move(made).value();
}

TEST(RenderPool, FirstSamplesGoBeforeOthers) {
  const std::shared_ptr<const Method> method = path_method();
  std::promise<void> begun, release;
  std::vector<std::uint64_t> order;
  {
    std::promise<void> all;
    RenderPool pool(1, [&](const RenderedTile& tile) {
      order.push_back(tile.ticket);
      if (order.size() == 1) {
        begun.set_value();
        release.get_future().wait();
      } else if (order.size() == 6) {
        all.set_value();
      }
    });
    pool.add({0, {0, 1}, {0, 0, 64, 64}, method});
    begun.get_future().wait();
    pool.add({1, {0, 1}, {64, 0, 32, 64}, method});
    pool.add({2, {0, 0}, {0, 0, 64, 64}, method});
    pool.add({3, {1, 1}, {0, 0, 64, 64}, method});
    pool.add({4, {1, 0}, {0, 64, 64, 32}, method});
    pool.add({5, {0, 1}, {64, 64, 32, 32}, method});
    release.set_value();
    all.get_future().wait();
  }
  EXPECT_EQ(order, (std::vector<std::uint64_t>{0, 2, 4, 1, 3, 5}));
}

TEST(RenderPool, DestructionDropsWaitingTasks) {
  const std::shared_ptr<const Method> method = path_method();
  std::atomic<int> done = 0;
  {
    RenderPool pool(2, [&](const RenderedTile&) { ++done; });
    for (std::uint64_t ticket = 0; ticket < 100; ++ticket) {
      pool.add({ticket, {5, 0}, {0, 0, 64, 64}, method});
    }
  }
  EXPECT_LT(done, 100);
}

/// A ball that no light leaves, so a path ends only after its last scattering.
std::shared_ptr<const Method> endless_method() {
  static const test::TestScene scene = test::TestScene::from_text(R"({
    "film": {"width": 64, "height": 64},
    "camera": {"eye": [0, 0, 0], "look_at": [0, 0, -1], "vertical_fov_degrees": 60},
    "materials": [{"name": "white", "diffuse": {"reflectance": {"rgb": [1, 1, 1]}}},
                  {"name": "lamp", "diffuse": {"reflectance": {"rgb": [1, 1, 1]}}, "emission": {"rgb": [1, 1, 1]}}],
    "objects": [{"name": "room", "material": "white", "sphere": {"center": [0, 0, 0], "radius": 10}},
                {"name": "lamp", "material": "lamp", "sphere": {"center": [0, 5, 0], "radius": 1}}]})");
  Result<std::unique_ptr<Method>> made = make_method(scene.compiled(), {.name = "path", .max_bounces = kMaxBounces});
  EXPECT_TRUE(made.ok()) << made.status();
  return std::move(made).value();
}

/// Signals the beginning of its render.
class Announced final : public Method {
 public:
  explicit Announced(std::shared_ptr<const Method> method) : method_(std::move(method)) {}
  std::unique_ptr<Workspace> make_workspace() const override { return method_->make_workspace(); }
  Node render(const PixelRect& tile, SampleRange range, Workspace& workspace) const override {
    begun_.release();
    return method_->render(tile, range, workspace);
  }
  void wait_until_begun() const { begun_.acquire(); }

 private:
  std::shared_ptr<const Method> method_;
  mutable std::counting_semaphore<> begun_{0};
};

TEST(RenderPool, AStoppedTaskEndsBetweenBouncesWithoutValues) {
  const auto endless = std::make_shared<const Announced>(endless_method());
  Collected collected;
  RenderPool pool(1, [&](RenderedTile tile) { collected.add(std::move(tile)); });
  pool.add({1, {5, 1}, {0, 0, 64, 64}, endless});  // one tile would take hours
  pool.add({2, {5, 2}, {0, 0, 64, 64}, endless});
  pool.add({3, {0, 1}, {0, 0, 64, 64}, path_method()});
  endless->wait_until_begun();
  const auto cpu_seconds = [&] {
    const auto all = pool.at_work();
    return all.size() == 1 && all[0].first == 1 ? all[0].second : 0;
  };
  while (cpu_seconds() < 0.05) {
    std::this_thread::yield();
  }
  pool.stop(1);
  pool.stop(2);
  pool.stop(99);  // an unknown ticket
  const std::map<std::uint64_t, Node> nodes = collected.wait_for(3);
  EXPECT_TRUE(pool.at_work().empty());
  EXPECT_TRUE(nodes.at(1).values.empty());
  EXPECT_TRUE(nodes.at(2).values.empty());
  EXPECT_FALSE(nodes.at(3).values.empty());
}

TEST(RenderPool, DestructionStopsRunningTasks) {
  const auto endless = std::make_shared<const Announced>(endless_method());
  RenderPool pool(2, [](const RenderedTile&) {});
  pool.add({1, {5, 1}, {0, 0, 64, 64}, endless});
  pool.add({2, {5, 2}, {0, 0, 64, 64}, endless});
  endless->wait_until_begun();
  endless->wait_until_begun();
}

}  // namespace
}  // namespace lightmill
