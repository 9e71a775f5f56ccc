// A farm whose page is fed by a LiveHub. Tests move its clock.
#pragma once

#include <gtest/gtest.h>

#include <deque>
#include <future>

#include "lightmill/v1/web.pb.h"
#include "server/web/live_hub.h"
#include "tests/support/process.h"
#include "tests/support/step_clock.h"

namespace lightmill::test {

class NullStore final : public Store {
 public:
  Result<StoredState> load() override { return StoredState{}; }
  Result<FilmPiece> read_film(JobId, const FilmPosition&) override { return FilmPiece{}; }
  Status check_structure() override { return ok_status(); }
  Status commit(std::span<const StoreOp>) override { return ok_status(); }
};

/// A page that keeps what it is sent.
class Page final : public ViewerLink {
 public:
  bool busy() const override { return writing; }
  void send(MessageParts parts) override {
    std::string bytes;
    for (const SharedBytes& part : parts) {
      bytes += *part;
    }
    EXPECT_TRUE(messages.emplace_back().ParseFromString(bytes));
    writing = reads_slowly;
  }
  void close(const Status& why) override { closed.push_back(why); }
  std::vector<v1::ViewUpdate> messages;
  std::vector<Status> closed;
  bool reads_slowly = false, writing = false;
};

class LiveHubTest : public ::testing::Test {
 protected:
  LiveHubTest() {
    loop.set_handlers({.send = [this](const Outgoing& message) {
      if (const auto* grant = std::get_if<LeaseGrant>(&message.message)) {
        const MutexLock lock(mutex);
        grants.push_back(*grant);
      }
    }});
  }
  ~LiveHubTest() override {
    hub.reset();
    EXPECT_TRUE(loop.stop().ok());
  }

  static Call call_of(Identity caller) { return {std::move(caller), kWatchJob, "10.0.0.7:4711"}; }
  /// Runs `task` on the farm thread, and waits for it.
  void on_farm(const FarmLoop::Task& task) {
    const auto done = std::make_shared<std::promise<void>>();
    ASSERT_TRUE(loop.post([&task, done](FarmLoop::TaskContext& context) {
      task(context);
      done->set_value();
    }));
    ASSERT_EQ(done->get_future().wait_for(kTimeout), std::future_status::ready);
  }
  JobId submit(const std::string& owner, const std::string& request_id, int width = 64, int height = 64,
               const std::vector<std::string>& layers = {}) {
    JobSpec spec;
    spec.request_id = request_id;
    spec.name = request_id;
    spec.owner = owner;
    spec.goal.samples = 1;
    spec.settings.scene = "scene";
    spec.settings.width = width;
    spec.settings.height = height;
    spec.settings.crop = {0, 0, width, height};
    spec.settings.layers = film_layers(layers).value();
    spec.settings.renderer_version = kRendererVersion;
    JobId job;
    on_farm([&](FarmLoop::TaskContext& context) {
      job = context.farm.submit(spec, context.now, context.unix_ms, context.effects).value();
    });
    return job;
  }
  /// A worker renders the job to its end. All its values are one.
  void render(JobId job) {
    on_farm([](FarmLoop::TaskContext& context) {
      const WorkerHello hello{"worker", "host", 1, 1, "class-a", kRendererVersion, {}, false};
      context.farm.worker_connected(SessionId{1}, hello, context.now, context.effects);
    });
    EXPECT_TRUE(eventually([&] {
      std::vector<LeaseGrant> todo;
      {
        const MutexLock lock(mutex);
        todo = std::exchange(grants, {});
      }
      for (const LeaseGrant& grant : todo) {
        on_farm([&](FarmLoop::TaskContext& context) { complete(grant, context); });
      }
      bool done = false;
      on_farm([&](FarmLoop::TaskContext& context) {
        done = context.farm.status(job, context.now)->state == JobState::done;
      });
      return done;
    }));
  }
  static void complete(const LeaseGrant& grant, FarmLoop::TaskContext& context) {
    const Film& film = *context.farm.film(grant.unit.job);
    for (std::size_t i = 0; i < grant.unit.tiles.size(); ++i) {
      const TileId tile = grant.unit.tiles[i];
      WorkerResult result;
      result.tag = grant.tags[i];
      result.lease = grant.lease;
      result.key = {grant.unit.job, tile, grant.unit.range};
      result.node = {grant.unit.range, std::vector<float>(film.expected_values(tile, grant.unit.range), 1.f), 0};
      result.hash = hash_of(result.node);
      result.render_digest = context.farm.status(grant.unit.job, context.now)->render_digest;
      result.seconds = 0.01;
      context.farm.worker_message(SessionId{1}, std::move(result), context.now, context.unix_ms, context.effects);
    }
  }
  /// More than half a second passes, with all that happens in it.
  void settle() {
    for (int i = 0; i < 4; ++i) {
      clock.pass(std::chrono::milliseconds(300));
      hub->tick();
      on_farm([](FarmLoop::TaskContext&) {});
      // A task's effects leave after it. The next task finds them done.
      on_farm([](FarmLoop::TaskContext&) {});
      run_posted();
    }
  }
  /// Asks again until `done`. The farm publishes at its own pace, which can take long.
  template <typename Done>
  void ask_until(Done done, Page& page, JobId job, const std::vector<std::string>& layers) {
    for (int tries = 0; tries < 20'000 && !done(); ++tries) {
      settle();
      ASSERT_TRUE(ask(page, false, job, layers).ok());
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
  }
  void run_posted() {
    for (;;) {
      std::function<void()> task;
      {
        const MutexLock lock(mutex);
        if (posted.empty()) {
          return;
        }
        task = std::move(posted.front());
        posted.pop_front();
      }
      task();
    }
  }
  Status ask(Page& page, bool hidden = false, JobId job = {}, const std::vector<std::string>& layers = {}) {
    v1::ViewRequest request;
    request.set_hidden(hidden);
    request.set_jobs(true);
    request.set_workers(true);
    request.set_job(job.value);
    request.set_seen(page.messages.size());
    request.mutable_layers()->Add(layers.begin(), layers.end());
    return hub->ask(page, request.SerializeAsString());
  }

  Mutex mutex;
  std::deque<std::function<void()>> posted LM_GUARDED_BY(mutex);
  std::vector<LeaseGrant> grants LM_GUARDED_BY(mutex);
  StepClock clock;
  NullStore store;
  Coordinator farm{CoordinatorLimits{}, StoredState{}, system_clock().now()};
  ActionLog actions{ActionLogLimits{}, {}};
  FarmLoop loop{farm, actions, store, system_clock(), [](const Status&) {}};
  std::optional<LiveHub> hub{std::in_place, loop, FarmGreeting{"1.0", {"be kind"}, {}},
                             OnWebThread([this](std::function<void()> task) {
                               const MutexLock lock(mutex);
                               posted.push_back(std::move(task));
                             }),
                             clock};
};

}  // namespace lightmill::test
