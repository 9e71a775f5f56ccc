#include "server/runtime/commit_queue.h"

#include <gtest/gtest.h>

#include <atomic>
#include <future>

#include "tests/support/process.h"

namespace lightmill {
namespace {

/// A store that records its calls, and fails on request.
class RecordingStore final : public Store {
 public:
  Result<StoredState> load() override { return StoredState{}; }
  /// Returns the prepared pieces, and waits before each of them.
  Result<FilmPiece> read_film(JobId, const FilmPosition& after) override {
    const MutexLock lock(mutex_);
    reads_.push_back(after.tile);
    while (pieces_.empty()) {
      changed_.wait(mutex_);
    }
    Result<FilmPiece> piece = std::move(pieces_.front());
    pieces_.pop_front();
    return piece;
  }
  Status check_structure() override { return ok_status(); }
  Status commit(std::span<const StoreOp> ops) override {
    const MutexLock lock(mutex_);
    if (!failures_.empty()) {
      const Status failure = failures_.front();
      failures_.pop_front();
      return failure;
    }
    while (held_) {
      changed_.wait(mutex_);
    }
    std::size_t nodes = 0;
    for (const StoreOp& op : ops) {
      if (const auto* const rows = std::get_if<DeleteJobRows>(&op)) {
        deleted_.push_back(rows->job.value);
      }
      nodes += std::holds_alternative<PutNode>(op) ? 1 : 0;
    }
    most_nodes_ = std::max(most_nodes_, nodes);
    ++commits_;
    return ok_status();
  }
  void give(Result<FilmPiece> piece) {
    const MutexLock lock(mutex_);
    pieces_.push_back(std::move(piece));
    changed_.notify_all();
  }
  /// Commits wait while it is held.
  void hold(bool held) {
    const MutexLock lock(mutex_);
    held_ = held;
    changed_.notify_all();
  }
  /// Nodes in the largest commit.
  std::size_t most_nodes() {
    const MutexLock lock(mutex_);
    return most_nodes_;
  }
  /// The tiles behind which films were read.
  std::vector<std::int64_t> reads() {
    const MutexLock lock(mutex_);
    return reads_;
  }
  void fail_next(Status status) {
    const MutexLock lock(mutex_);
    failures_.push_back(std::move(status));
  }
  std::vector<std::uint64_t> deleted() {
    const MutexLock lock(mutex_);
    return deleted_;
  }
  int commits() {
    const MutexLock lock(mutex_);
    return commits_;
  }

 private:
  Mutex mutex_;
  CondVar changed_;
  std::deque<Result<FilmPiece>> pieces_ LM_GUARDED_BY(mutex_);
  std::vector<std::int64_t> reads_ LM_GUARDED_BY(mutex_);
  std::deque<Status> failures_ LM_GUARDED_BY(mutex_);
  std::vector<std::uint64_t> deleted_ LM_GUARDED_BY(mutex_);
  int commits_ LM_GUARDED_BY(mutex_) = 0;
  bool held_ LM_GUARDED_BY(mutex_) = false;
  std::size_t most_nodes_ LM_GUARDED_BY(mutex_) = 0;
};

class CommitQueueTest : public ::testing::Test {
 protected:
  /// Effects that a number identifies.
  void push(std::uint64_t number, std::vector<CommitReply> replies = {}, std::vector<CommitReply> callers = {}) {
    queue_->push({{DeleteJobRows{JobId{number}}},
                  {{SessionId{number}, ResultAck{}}},
                  std::move(replies),
                  std::move(callers),
                  {}});
  }

  RecordingStore store_;
  Mutex mutex_;
  std::vector<std::uint64_t> sent_ LM_GUARDED_BY(mutex_);
  std::atomic<int> fatal_ = 0;
  std::unique_ptr<CommitQueue> queue_ =
      std::make_unique<CommitQueue>(store_, CommitQueue::Handlers{[this](Outgoing message) {
                                                                    EXPECT_GE(store_.deleted().size(), sent_count() + 1)
                                                                        << "sent before it was stored";
                                                                    const MutexLock lock(mutex_);
                                                                    sent_.push_back(message.to.value);
                                                                  },
                                                                  [this](const Status&) { ++fatal_; }});
  std::size_t sent_count() {
    const MutexLock lock(mutex_);
    return sent_.size();
  }
};

TEST_F(CommitQueueTest, StoresThenSendsAllInOrder) {
  std::vector<std::uint64_t> expected;
  for (std::uint64_t i = 1; i <= 500; ++i) {
    push(i);
    expected.push_back(i);
  }
  EXPECT_TRUE(queue_->stop().ok());
  EXPECT_EQ(store_.deleted(), expected);
  const MutexLock lock(mutex_);
  EXPECT_EQ(sent_, expected);
}

TEST_F(CommitQueueTest, UnawaitedWritesShareFewTransactions) {
  for (std::uint64_t i = 1; i <= 100; ++i) {
    push(i);
  }
  EXPECT_TRUE(queue_->stop().ok());
  EXPECT_LT(store_.commits(), 10);
}

TEST_F(CommitQueueTest, AFullDiskDelaysWritesAndLosesNone) {
  store_.fail_next(resource_exhausted("the disk is full"));
  store_.fail_next(unavailable("and still is"));
  std::atomic<int> answered = 0;
  push(1, {[&](const Status& status) {
         EXPECT_EQ(sent_count(), 0u) << "before its messages leave";
         answered = status.ok() ? 1 : 2;
       }});
  EXPECT_TRUE(test::eventually([&] { return answered != 0; }));
  EXPECT_EQ(answered, 1);
  EXPECT_TRUE(queue_->stop().ok());
  EXPECT_EQ(store_.deleted(), std::vector<std::uint64_t>{1});
  EXPECT_EQ(fatal_, 0);
}

TEST_F(CommitQueueTest, CallersLearnOfADelayAndTheirWritesAreStored) {
  for (int i = 0; i < 3; ++i) {
    store_.fail_next(resource_exhausted("the disk is full"));
  }
  Mutex mutex;
  std::vector<std::string> heard;
  const auto caller = [&](std::string name) {
    return [&, name](const Status& status) {
      const MutexLock lock(mutex);
      heard.push_back(name + ": " + (status.ok() ? "stored" : message_of(status)));
    };
  };
  push(1, {caller("reply")}, {caller("caller")});
  push(2, {}, {caller("behind")});
  EXPECT_EQ(store_.commits(), 0);
  EXPECT_TRUE(test::eventually([&] {
    const MutexLock lock(mutex);
    return heard.size() == 3;
  }));
  EXPECT_TRUE(queue_->stop().ok());
  EXPECT_EQ(store_.deleted(), (std::vector<std::uint64_t>{1, 2}));
  const std::string delayed =
      "the farm has accepted this, but cannot store it yet: the disk is full. It will be done when it "
      "can be stored: do not repeat the request";
  EXPECT_EQ(heard, (std::vector<std::string>{"caller: " + delayed, "behind: " + delayed, "reply: stored"}));
}

TEST_F(CommitQueueTest, BytesThatWaitForTheStoreHaveALimit) {
  // One node of 64 MiB, which all writes share. The queue counts it each time.
  const auto node = std::make_shared<Node>(Node{{}, std::vector<float>(std::size_t{16} << 20), 0});
  store_.hold(true);
  std::atomic<int> pushed = 0;
  std::thread pusher([&] {
    for (std::uint32_t i = 0; i < 20; ++i) {
      queue_->push({{PutNode{JobId{1}, TileId{i}, node}}, {}, {[](const Status&) {}}, {}, {}});
      ++pushed;
    }
  });
  EXPECT_TRUE(test::eventually([&] { return pushed >= 3; }));
  store_.hold(false);
  pusher.join();
  EXPECT_TRUE(queue_->stop().ok());
  EXPECT_LE(store_.most_nodes(), 2u);
}

FilmPiece piece_of(std::uint32_t tile, bool more) {
  FilmPiece piece;
  piece.nodes.emplace_back(TileId{tile}, NodeOutline{});
  if (more) {
    piece.last = {tile, 0, 0};
  }
  return piece;
}

TEST_F(CommitQueueTest, AFilmIsReadAfterEarlierWritesAndCommitsRunBetweenItsPieces) {
  std::promise<Result<StoredFilm>> film;
  queue_->push(
      {{DeleteJobRows{JobId{1}}}, {}, {}, {}, {{JobId{7}, [&](Result<StoredFilm> read) {
                                                  EXPECT_EQ(store_.deleted(), (std::vector<std::uint64_t>{1, 2}));
                                                  film.set_value(std::move(read));
                                                }}}});
  EXPECT_TRUE(test::eventually([&] { return !store_.reads().empty(); }));
  EXPECT_EQ(store_.deleted(), std::vector<std::uint64_t>{1});
  push(2);
  store_.give(piece_of(3, true));
  EXPECT_TRUE(test::eventually([&] { return store_.reads().size() == 2; }));
  EXPECT_EQ(store_.deleted(), (std::vector<std::uint64_t>{1, 2})) << "between two pieces";
  store_.give(piece_of(4, false));
  const Result<StoredFilm> read = film.get_future().get();
  ASSERT_TRUE(read.ok());
  ASSERT_EQ(read->size(), 2u);
  EXPECT_EQ((*read)[1].tile, TileId{4});
  EXPECT_EQ(store_.reads(), (std::vector<std::int64_t>{-1, 3}));
  EXPECT_TRUE(queue_->stop().ok());
}

TEST_F(CommitQueueTest, AnUnavailableFilmIsRetriedAndOtherErrorsReachTheReader) {
  store_.give(unavailable("the database is away"));
  store_.give(piece_of(3, false));
  store_.give(data_loss("a page is damaged"));
  std::promise<Status> first, second;
  queue_->push({{},
                {},
                {},
                {},
                {{JobId{7}, [&](const Result<StoredFilm>& read) { first.set_value(read.status()); }},
                 {JobId{8}, [&](const Result<StoredFilm>& read) { second.set_value(read.status()); }}}});
  EXPECT_TRUE(first.get_future().get().ok());
  EXPECT_EQ(second.get_future().get().code(), StatusCode::kDataLoss);
  push(1);
  EXPECT_TRUE(queue_->stop().ok());
  EXPECT_EQ(fatal_, 0);
  EXPECT_EQ(store_.deleted(), std::vector<std::uint64_t>{1});
}

TEST_F(CommitQueueTest, DamageStopsStoringSendingAndConfirming) {
  store_.fail_next(data_loss("the file is damaged"));
  std::atomic<int> refused = 0;
  push(1, {[&](const Status& status) { refused += status.ok() ? 0 : 1; }});
  push(2, {[&](const Status& status) { refused += status.ok() ? 0 : 1; }});
  EXPECT_EQ(queue_->stop().code(), StatusCode::kDataLoss);
  EXPECT_EQ(refused, 2);
  EXPECT_EQ(fatal_, 1);
  EXPECT_TRUE(store_.deleted().empty());
  EXPECT_EQ(sent_count(), 0u);
}

}  // namespace
}  // namespace lightmill
