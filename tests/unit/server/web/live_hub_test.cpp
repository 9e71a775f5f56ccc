#include "server/web/live_hub.h"

#include <gtest/gtest.h>

#include <deque>

#include "lightmill/v1/web.pb.h"

namespace lightmill::test {
namespace {

class NullStore final : public Store {
 public:
  Result<StoredState> load() override { return StoredState{}; }
  Result<FilmPiece> read_film(JobId, const FilmPosition&) override { return FilmPiece{}; }
  Status check_structure() override { return ok_status(); }
  Status commit(std::span<const StoreOp>) override { return ok_status(); }
};

/// A clock that moves only when the test says so.
class StepClock final : public Clock {
 public:
  Time now() const override { return now_; }
  std::int64_t unix_milliseconds() const override { return 0; }
  void pass(Duration time) { now_ += time; }

 private:
  Time now_{std::chrono::seconds(1000)};
};

Call call_of(Identity caller) {
  return {std::move(caller), Rpc::watch_job, "10.0.0.7:4711"};
}

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

  /// Runs `task` on the farm thread, and waits for it.
  void on_farm(const FarmLoop::Task& task) {
    std::atomic<bool> done = false;
    ASSERT_TRUE(loop.post([&](FarmLoop::TaskContext& context) {
      task(context);
      done = true;
    }));
    while (!done) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
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
    for (bool done = false; !done;) {
      std::vector<LeaseGrant> todo;
      {
        const MutexLock lock(mutex);
        todo = std::exchange(grants, {});
      }
      for (const LeaseGrant& grant : todo) {
        on_farm([&](FarmLoop::TaskContext& context) { complete(grant, context); });
      }
      on_farm([&](FarmLoop::TaskContext& context) {
        done = context.farm.status(job, context.now)->state == JobState::done;
      });
    }
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

TEST_F(LiveHubTest, APageGetsTheGreetingFirstAndNothingBeforeItsRequest) {
  Page page;
  hub->add(page, call_of(anybody()));
  submit("ada", "one");
  settle();
  EXPECT_TRUE(page.messages.empty());
  ASSERT_TRUE(ask(page).ok());
  ASSERT_EQ(page.messages.size(), 1u);
  EXPECT_EQ(page.messages[0].greeting().version(), "1.0");
  EXPECT_EQ(page.messages[0].greeting().notices(0), "be kind");
  settle();
  ASSERT_EQ(page.messages.size(), 2u);
  EXPECT_TRUE(page.messages[1].jobs().whole());
  ASSERT_EQ(page.messages[1].jobs().jobs_size(), 1);
  EXPECT_EQ(page.messages[1].jobs().jobs(0).name(), "one");
  hub->remove(page);
}

TEST_F(LiveHubTest, OnlyChangesAreSent) {
  Page page;
  hub->add(page, call_of(anybody()));
  const JobId first = submit("ada", "one");
  ASSERT_TRUE(ask(page).ok());
  settle();
  submit("ada", "two");
  ASSERT_TRUE(ask(page).ok());
  settle();
  ASSERT_FALSE(page.messages.empty());
  const v1::JobChanges& added = page.messages.back().jobs();
  EXPECT_FALSE(added.whole());
  ASSERT_EQ(added.jobs_size(), 1);
  EXPECT_EQ(added.jobs(0).name(), "two");
  on_farm([&](FarmLoop::TaskContext& context) {
    EXPECT_TRUE(context.farm.cancel(first, context.now, context.unix_ms, context.effects).ok());
    EXPECT_TRUE(context.farm.remove(first, context.now, context.effects).ok());
  });
  ASSERT_TRUE(ask(page).ok());
  settle();
  ASSERT_EQ(page.messages.back().jobs().removed_size(), 1);
  EXPECT_EQ(page.messages.back().jobs().removed(0), first.value);
  hub->remove(page);
}

TEST_F(LiveHubTest, HiddenPagesGetNothingAndCatchUp) {
  Page page;
  hub->add(page, call_of(anybody()));
  ASSERT_TRUE(ask(page).ok());
  settle();
  ASSERT_TRUE(ask(page, true).ok());
  const std::size_t before = page.messages.size();
  submit("ada", "one");
  submit("ada", "two");
  clock.pass(std::chrono::seconds(60));
  settle();
  EXPECT_EQ(page.messages.size(), before) << "not even a sign of life";
  ASSERT_TRUE(ask(page).ok());
  settle();
  std::set<std::string> names;
  for (std::size_t i = before; i < page.messages.size(); ++i) {
    for (const v1::Job& job : page.messages[i].jobs().jobs()) {
      names.insert(job.name());
    }
  }
  EXPECT_EQ(names, (std::set<std::string>{"one", "two"}));
  hub->remove(page);
}

TEST_F(LiveHubTest, AStalledPageGetsTwoMessagesAndThenOnlyTheNewest) {
  Page page;
  hub->add(page, call_of(anybody()));
  ASSERT_TRUE(ask(page).ok());
  const JobId job = submit("ada", "one");
  settle();
  ASSERT_EQ(page.messages.size(), 2u);
  const auto set_paused = [&](bool paused) {
    on_farm([&](FarmLoop::TaskContext& context) {
      const Status status = paused ? context.farm.pause(job, context.now, context.effects)
                                   : context.farm.resume(job, context.now, context.effects);
      EXPECT_TRUE(status.ok()) << status;
    });
    settle();
  };
  set_paused(true);
  set_paused(false);
  set_paused(true);
  EXPECT_EQ(page.messages.size(), 2u);
  ASSERT_TRUE(ask(page).ok());
  ASSERT_EQ(page.messages.size(), 3u);
  ASSERT_EQ(page.messages[2].jobs().jobs_size(), 1);
  EXPECT_EQ(page.messages[2].jobs().jobs(0).state(), v1::JOB_STATE_PAUSED);
  hub->remove(page);
}

TEST_F(LiveHubTest, AWritingSocketGetsNoMessage) {
  Page page;
  page.reads_slowly = true;
  hub->add(page, call_of(anybody()));
  ASSERT_TRUE(ask(page).ok());
  submit("ada", "one");
  settle();
  EXPECT_EQ(page.messages.size(), 1u);
  page.writing = false;
  hub->written(page);
  EXPECT_EQ(page.messages.size(), 2u);
  hub->remove(page);
}

TEST_F(LiveHubTest, AQuietFarmSendsAMessageEveryFiveSeconds) {
  Page page;
  hub->add(page, call_of(anybody()));
  ASSERT_TRUE(ask(page).ok());
  settle();
  ASSERT_TRUE(ask(page).ok());
  const std::size_t before = page.messages.size();
  clock.pass(std::chrono::seconds(5));
  hub->tick();
  ASSERT_EQ(page.messages.size(), before + 1);
  EXPECT_EQ(page.messages.back().ByteSizeLong(), 0u);
  hub->remove(page);
}

TEST_F(LiveHubTest, JobsOfOthersAreNeitherListedNorShown) {
  const JobId others = submit("bob", "his");
  submit("ada", "hers");
  Page page;
  hub->add(page, call_of({"ada", {Role::submit}, Proof::certificate, 0, ""}));
  ASSERT_TRUE(ask(page, false, others).ok());
  std::set<std::string> names;
  std::string failure;
  for (int i = 0; i < 3; ++i) {
    settle();
    ASSERT_TRUE(ask(page, false, others).ok());
  }
  for (const v1::ViewUpdate& message : page.messages) {
    EXPECT_FALSE(message.has_job());
    failure += message.job_failure();
    for (const v1::Job& job : message.jobs().jobs()) {
      names.insert(job.name());
    }
  }
  EXPECT_EQ(names, std::set<std::string>{"hers"});
  EXPECT_NE(failure.find("somebody else's"), std::string::npos) << failure;
  hub->remove(page);
}

TEST_F(LiveHubTest, ARevokedCallerIsDisconnectedOnceAndGetsNothingMore) {
  for (const bool hidden : {false, true}) {
    Page page;
    bool known = true;
    hub->add(page, call_of(anybody()),
             [&] { return known ? ok_status() : make_error(StatusCode::kUnauthenticated, "the token was revoked"); });
    ASSERT_TRUE(ask(page, hidden).ok());
    settle();
    EXPECT_TRUE(page.closed.empty());
    const std::size_t before = page.messages.size();
    known = false;
    submit("ada", hidden ? "two" : "one");
    settle();
    settle();
    ASSERT_EQ(page.closed.size(), 1u);
    EXPECT_EQ(message_of(page.closed[0]), "the token was revoked");
    EXPECT_EQ(page.messages.size(), before);
    hub->remove(page);
  }
}

TEST_F(LiveHubTest, TheOpenJobIsFollowedAndAMissingOneIsReported) {
  const JobId job = submit("ada", "one");
  Page page;
  hub->add(page, call_of(anybody()));
  ASSERT_TRUE(ask(page, false, JobId{42}).ok());
  settle();
  ASSERT_TRUE(ask(page, false, JobId{42}).ok());
  settle();
  std::string failure;
  for (const v1::ViewUpdate& message : page.messages) {
    failure += message.job_failure();
  }
  EXPECT_EQ(failure, "there is no job 42");
  ASSERT_TRUE(ask(page, false, job).ok());
  settle();
  ASSERT_TRUE(ask(page, false, job).ok());
  bool shown = false;
  for (const v1::ViewUpdate& message : page.messages) {
    shown = shown || (message.has_job() && message.job().id() == job.value);
  }
  EXPECT_TRUE(shown);
  hub->remove(page);
}

/// The number of tiles of each layer, from message `first` on.
std::map<std::string, std::size_t> tiles_of(const Page& page, std::size_t first = 0) {
  std::map<std::string, std::size_t> counts;
  for (std::size_t i = first; i < page.messages.size(); ++i) {
    for (const v1::ViewTile& tile : page.messages[i].tiles()) {
      ++counts[tile.layer()];
    }
  }
  return counts;
}

/// The last failure of each layer.
std::map<std::string, std::string> layer_failures(const Page& page) {
  std::map<std::string, std::string> failures;
  for (const v1::ViewUpdate& message : page.messages) {
    for (const v1::LayerFailure& failure : message.layer_failures()) {
      failures[failure.layer()] = failure.why();
    }
  }
  return failures;
}

std::size_t failed_layers(const Page& page) {
  const std::map<std::string, std::string> failures = layer_failures(page);
  return static_cast<std::size_t>(
      std::ranges::count_if(failures, [](const auto& each) { return !each.second.empty(); }));
}

TEST_F(LiveHubTest, LayersOfALargePictureAreSentInTurn) {
  const std::vector<std::string> layers{"light:key", "light:rest"};
  const JobId job = submit("ada", "large", 64 * 20, 64 * 10, layers);
  render(job);
  Page page;
  hub->add(page, call_of(anybody()));
  ASSERT_TRUE(ask(page, false, job, layers).ok());
  ask_until([&] { return tiles_of(page).size() == 3; }, page, job, layers);
  std::set<std::string> first_of_messages;
  for (const v1::ViewUpdate& message : page.messages) {
    if (message.tiles_size() > 0) {
      first_of_messages.insert(message.tiles(0).layer());
    }
  }
  EXPECT_EQ(first_of_messages, (std::set<std::string>{"", "light:key", "light:rest"}));
  EXPECT_LT(tiles_of(page)[""], 200u) << "the others came before it was whole";
  const std::map<std::string, std::size_t> all{{"", 200}, {"light:key", 200}, {"light:rest", 200}};
  ask_until([&] { return tiles_of(page) == all; }, page, job, layers);
  EXPECT_EQ(tiles_of(page), all);
  hub->remove(page);
}

TEST_F(LiveHubTest, ALayerWithoutRoomIsSentWhenThereIsRoom) {
  // 32,640 of 32,768 tiles: none is rendered, but room is kept for all.
  const JobId large = submit("ada", "large", 64 * 255, 64 * 128);
  const std::vector<std::string> layers{"light:key", "light:rest"};
  const JobId job = submit("ada", "small", 64 * 10, 64 * 8, layers);
  Page first, second;
  hub->add(first, call_of(anybody()));
  ASSERT_TRUE(ask(first, false, large).ok());
  settle();
  hub->add(second, call_of(anybody()));
  // There is room for 80 tiles once.
  ASSERT_TRUE(ask(second, false, job).ok());
  ask_until([&] { return failed_layers(second) == 2; }, second, job, layers);
  auto failures = layer_failures(second);
  EXPECT_FALSE(failures.contains("")) << failures[""];
  EXPECT_NE(failures["light:key"].find("80 tiles"), std::string::npos) << failures["light:key"];
  EXPECT_NE(failures["light:rest"].find("80 tiles"), std::string::npos) << failures["light:rest"];
  bool has_job = false;
  for (const v1::ViewUpdate& message : second.messages) {
    EXPECT_EQ(message.job_failure(), "");
    has_job = has_job || message.job().id() == job.value;
  }
  EXPECT_TRUE(has_job) << "the job itself is followed";
  hub->remove(first);
  ask_until([&] { return failed_layers(second) == 0; }, second, job, layers);
  failures = layer_failures(second);
  EXPECT_EQ(failures["light:key"], "");
  EXPECT_EQ(failures["light:rest"], "");
  on_farm([&](FarmLoop::TaskContext& context) {
    EXPECT_TRUE(context.farm.cancel(large, context.now, context.unix_ms, context.effects).ok());
  });
  render(job);
  const std::map<std::string, std::size_t> all{{"", 80}, {"light:key", 80}, {"light:rest", 80}};
  ask_until([&] { return tiles_of(second) == all; }, second, job, layers);
  EXPECT_EQ(tiles_of(second), all);
  hub->remove(second);
}

TEST_F(LiveHubTest, ATooLargePictureIsNotShownButItsJobIs) {
  const JobId job = submit("ada", "huge", 64 * 256, 64 * 129);
  Page page;
  hub->add(page, call_of(anybody()));
  for (int i = 0; i < 3; ++i) {
    ASSERT_TRUE(ask(page, false, job).ok());
    settle();
  }
  EXPECT_NE(layer_failures(page)[""].find("33024 tiles"), std::string::npos) << layer_failures(page)[""];
  EXPECT_EQ(page.messages.front().job_failure(), "");
  bool has_job = false;
  for (const v1::ViewUpdate& message : page.messages) {
    has_job = has_job || message.job().id() == job.value;
  }
  EXPECT_TRUE(has_job);
  hub->remove(page);
}

TEST_F(LiveHubTest, InvalidRequestsAreRefused) {
  Page page;
  hub->add(page, call_of(anybody()));
  EXPECT_EQ(hub->ask(page, "\xff\xff\xff").code(), StatusCode::kInvalidArgument);
  v1::ViewRequest request;
  request.set_seen(1);
  EXPECT_EQ(hub->ask(page, request.SerializeAsString()).code(), StatusCode::kInvalidArgument) << "more than were sent";
  request.set_seen(0);
  for (int i = 0; i <= kMostViewLayers; ++i) {
    request.add_layers(fmt::format("light:{}", i));
  }
  EXPECT_EQ(hub->ask(page, request.SerializeAsString()).code(), StatusCode::kInvalidArgument) << "too many layers";
  EXPECT_TRUE(page.messages.empty());
  hub->remove(page);
}

}  // namespace
}  // namespace lightmill::test
