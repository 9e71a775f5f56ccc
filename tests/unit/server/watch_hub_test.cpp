#include "server/runtime/watch_hub.h"

#include "tests/unit/server/coordinator_fixture.h"

namespace lightmill::test {
namespace {

/// A watcher's stream that keeps its messages, and reads as slowly as the test wants.
class Inbox final : public WatchSink {
 public:
  bool closed() override { return closed_; }
  bool writable() const override { return !busy && !closed_; }
  void offer(const WatchUpdate& update) override {
    EXPECT_TRUE(writable());
    updates.push_back(update);
    busy = reads_slowly;
  }
  void fail(const Status& status) override {
    failure = status;
    closed_ = true;
  }

  std::vector<WatchUpdate> updates;
  Status failure;
  bool reads_slowly = false;
  bool busy = false;

 private:
  bool closed_ = false;
};

class WatchHubTest : public CoordinatorTest {
 protected:
  std::shared_ptr<Inbox> watch(JobId job, bool tiles = true) {
    auto inbox = std::make_shared<Inbox>();
    hub.add(job, tiles, inbox);
    return inbox;
  }
  std::optional<Time> publish() { return hub.publish(*coordinator, now); }

  WatchHub hub;
};

TEST_F(WatchHubTest, TheFirstStateIsSentAtOnceAndThenOnlyChanges) {
  const auto inbox = watch(submit(spec()));
  publish();
  ASSERT_EQ(inbox->updates.size(), 1u);
  EXPECT_EQ(inbox->updates[0].job.state, JobState::queued);
  pass(std::chrono::seconds(1));
  EXPECT_EQ(publish(), std::nullopt);
  EXPECT_EQ(inbox->updates.size(), 1u);
}

TEST_F(WatchHubTest, AnUnknownJobEndsTheStream) {
  const auto inbox = watch(JobId{42});
  publish();
  EXPECT_EQ(inbox->failure.code(), StatusCode::kNotFound);
}

TEST_F(WatchHubTest, ChangesComeAtMostTenTimesASecondOnceEveryTileHasASample) {
  const JobId job = submit(spec("r1", 1024, {0, 0, 64, 64}));
  const auto inbox = watch(job);
  const SessionId worker = connect("w");
  std::size_t done = 0;
  std::size_t merged = 0;
  Time first_sample{};
  for (int i = 0; i < 100; ++i) {
    if (done < got<LeaseGrant>(worker).size()) {
      finish(worker, got<LeaseGrant>(worker)[done++]);
      merged += coordinator->status(job, now)->state == JobState::running ? 1 : 0;
      first_sample = first_sample == Time{} ? now : first_sample;
    }
    publish();
    pass(std::chrono::milliseconds(10));
    if (coordinator->status(job, now)->state == JobState::done) {
      break;
    }
  }
  const double seconds = to_seconds(now - first_sample);
  EXPECT_GT(merged, 5u) << "there must be something to hold back";
  EXPECT_LE(static_cast<double>(inbox->updates.size()), 3 + seconds * 10);
}

TEST_F(WatchHubTest, ChangingTilesDoNotDelayOthers) {
  const JobId job = submit(spec("r1", 1u << 20, {0, 0, 9 * kTileSize, 8 * kTileSize}));
  const auto inbox = watch(job);
  const SessionId worker = connect("w");
  std::size_t done = 0;
  const auto render_until_every_tile_has = [&](std::uint64_t samples) {
    while (coordinator->status(job, now)->min_tile_samples < samples) {
      ASSERT_LT(done, got<LeaseGrant>(worker).size());
      finish(worker, got<LeaseGrant>(worker)[done++]);
    }
    pass(std::chrono::seconds(1));
  };
  // All 72 tiles have changed before each message. A message holds 40 of them: from 0, from 44 and from 16.
  std::set<std::pair<int, int>> seen;
  for (std::uint64_t round = 1; round <= 3; ++round) {
    render_until_every_tile_has(round);
    inbox->updates.clear();
    inbox->reads_slowly = true;
    inbox->busy = false;
    publish();
    ASSERT_EQ(inbox->updates.size(), 1u);
    for (const auto& shared : inbox->updates[0].tiles) {
      const TileSnapshot& tile = shared->tile;
      seen.insert({tile.rect.x, tile.rect.y});
    }
  }
  EXPECT_EQ(seen.size(), 72u);
}

TEST_F(WatchHubTest, ASlowReaderGetsTheNewestStateWithoutAQueue) {
  const JobId job = submit(spec("r1", 1u << 20, {0, 0, 64, 64}));
  const auto inbox = watch(job);
  inbox->reads_slowly = true;
  publish();
  ASSERT_EQ(inbox->updates.size(), 1u);
  const SessionId worker = connect("w");
  for (std::size_t i = 0; i < 3; ++i) {
    ASSERT_GT(got<LeaseGrant>(worker).size(), i);
    finish(worker, got<LeaseGrant>(worker)[i]);
    pass(std::chrono::seconds(1));
    publish();
  }
  EXPECT_EQ(inbox->updates.size(), 1u);
  inbox->busy = false;
  publish();
  ASSERT_EQ(inbox->updates.size(), 2u);
  EXPECT_EQ(inbox->updates[1].job.samples_done, coordinator->status(job, now)->samples_done);
  ASSERT_EQ(inbox->updates[1].tiles.size(), 1u);
  EXPECT_EQ(inbox->updates[1].tiles[0]->tile.samples, coordinator->film(job)->samples(TileId{0}));
}

TEST_F(WatchHubTest, ALargeFilmTakesSeveralMessagesAndMarksTheLast) {
  const JobId job = submit(spec("r1", 1, {0, 0, 640, 640}));
  const SessionId worker = connect("w");
  work(worker);
  ASSERT_EQ(status(job).state, JobState::done);
  const auto inbox = watch(job);
  for (int i = 0; i < 10; ++i) {
    publish();
  }
  ASSERT_EQ(inbox->updates.size(), 3u) << "100 tiles, 40 at a time";
  std::set<std::pair<int, int>> corners;
  for (const WatchUpdate& update : inbox->updates) {
    EXPECT_EQ(update.last, &update == &inbox->updates.back());
    for (const auto& shared : update.tiles) {
      const TileSnapshot& tile = shared->tile;
      corners.insert({tile.rect.x, tile.rect.y});
    }
  }
  EXPECT_EQ(corners.size(), 100u);
}

TEST_F(WatchHubTest, ALateWatcherSharesTilesAndCatchesUp) {
  const JobId job = submit(spec("r1", 1u << 20, {0, 0, 9 * kTileSize, 8 * kTileSize}));
  const SessionId worker = connect("w");
  const auto first = watch(job);
  std::size_t done = 0;
  const auto render_until_every_tile_has = [&](std::uint64_t samples) {
    while (coordinator->status(job, now)->min_tile_samples < samples) {
      ASSERT_LT(done, got<LeaseGrant>(worker).size());
      finish(worker, got<LeaseGrant>(worker)[done++]);
    }
    pass(std::chrono::seconds(1));
  };
  render_until_every_tile_has(1);
  publish();  // the first has 40 of 72 tiles
  const auto second = watch(job);
  render_until_every_tile_has(2);
  publish();
  ASSERT_EQ(first->updates.size(), 2u);
  ASSERT_EQ(second->updates.size(), 1u);
  EXPECT_EQ(first->updates[1].tiles, second->updates[0].tiles) << "the very same ones, made once";
  for (int i = 0; i < 5; ++i) {
    publish();
  }
  std::set<std::pair<int, int>> corners;
  for (const WatchUpdate& update : second->updates) {
    for (const auto& shared : update.tiles) {
      corners.insert({shared->tile.rect.x, shared->tile.rect.y});
    }
  }
  EXPECT_EQ(corners.size(), 72u);
}

TEST_F(WatchHubTest, AReaderOfEverySecondMessageMissesNoTile) {
  // Four messages hold the picture, and all of it changes before each. If rounds went in order, every second message
  // would hold the same two quarters.
  const JobId job = submit(spec("r1", 1u << 20, {0, 0, 10 * kTileSize, 16 * kTileSize}));
  const SessionId worker = connect("w");
  const auto quick = watch(job), slow = watch(job);
  slow->reads_slowly = true;
  std::size_t done = 0;
  std::set<std::pair<int, int>> seen;
  for (int round = 0; round < 17; ++round) {
    const std::uint64_t before = coordinator->status(job, now)->min_tile_samples;
    while (coordinator->status(job, now)->min_tile_samples == before) {
      ASSERT_LT(done, got<LeaseGrant>(worker).size());
      finish(worker, got<LeaseGrant>(worker)[done++]);
    }
    pass(std::chrono::seconds(1));
    slow->busy = round % 2 == 1;
    publish();
  }
  EXPECT_EQ(quick->updates.size(), 17u);
  EXPECT_EQ(slow->updates.size(), 9u);
  EXPECT_EQ(slow->updates.back().tiles, quick->updates.back().tiles) << "the very same ones, made once";
  for (const WatchUpdate& update : slow->updates) {
    for (const auto& shared : update.tiles) {
      seen.insert({shared->tile.rect.x, shared->tile.rect.y});
    }
  }
  EXPECT_EQ(seen.size(), 160u);
}

TEST_F(WatchHubTest, AWatcherWithoutTilesGetsOnlyTheState) {
  const JobId job = submit(spec());
  const auto inbox = watch(job, false);
  work(connect("w"));
  publish();
  ASSERT_EQ(inbox->updates.size(), 1u);
  EXPECT_TRUE(inbox->updates[0].last);
  EXPECT_TRUE(inbox->updates[0].tiles.empty());
}

TEST_F(WatchHubTest, AnEndIsShownAtOnceWhenItIsStored) {
  stores_ends = false;
  const JobId job = submit(spec());
  const auto inbox = watch(job);
  work(connect("w"));
  publish();
  ASSERT_EQ(inbox->updates.size(), 1u);
  EXPECT_EQ(inbox->updates[0].job.state, JobState::running);
  EXPECT_EQ(inbox->updates[0].job.min_tile_samples, 4u);
  EXPECT_FALSE(inbox->updates[0].last);
  store_ends();
  hub.hurry(job);
  EXPECT_EQ(publish(), std::nullopt);
  ASSERT_EQ(inbox->updates.size(), 2u);
  EXPECT_EQ(inbox->updates[1].job.state, JobState::done);
  EXPECT_TRUE(inbox->updates[1].last);
}

TEST_F(WatchHubTest, TilesOfAnEndedJobComeOnceItsFilmIsRead) {
  const JobId job = submit(spec("r1", 1));
  work(connect("w"));
  StoredFilm stored;
  for (TileId tile{0}; tile.value < 2; ++tile.value) {
    stored.emplace_back(tile, std::make_shared<const Node>(*coordinator->film(job)->forest(tile).front()));
  }
  writes.clear();
  pass(limits.film_idle);
  ASSERT_EQ(coordinator->film(job), nullptr);
  const auto inbox = watch(job), without_tiles = watch(job, false);
  publish();
  ASSERT_EQ(inbox->updates.size(), 1u);
  EXPECT_EQ(inbox->updates[0].job.state, JobState::done);
  EXPECT_TRUE(inbox->updates[0].tiles.empty());
  EXPECT_FALSE(inbox->updates[0].last);
  EXPECT_TRUE(without_tiles->updates[0].last);
  EXPECT_EQ(hub.take_wanted_films(), std::set{job});
  pass(std::chrono::seconds(1));
  publish();
  EXPECT_EQ(inbox->updates.size(), 1u) << "nothing has changed";

  EXPECT_FALSE(coordinator->use_film(job, now, effects).value());
  flush();
  EXPECT_TRUE(hub.take_wanted_films().empty()) << "it was said";
  coordinator->film_read(job, std::move(stored), now, effects);
  hub.film_loaded(*coordinator, job, now);
  ASSERT_EQ(inbox->updates.size(), 2u);
  EXPECT_EQ(inbox->updates[1].tiles.size(), 2u);
  EXPECT_TRUE(inbox->updates[1].last);
}

TEST_F(WatchHubTest, AnUnreadableFilmEndsTheStreamsThatWaitForIt) {
  const JobId job = submit(spec("r1", 1));
  work(connect("w"));
  writes.clear();
  pass(limits.film_idle);
  const auto inbox = watch(job);
  publish();
  const auto later = watch(submit(spec("r2", 1)));
  hub.fail_film(job, data_loss("a page is damaged"));
  EXPECT_EQ(inbox->failure.code(), StatusCode::kDataLoss);
  publish();
  EXPECT_FALSE(later->updates.empty());
}

}  // namespace
}  // namespace lightmill::test
