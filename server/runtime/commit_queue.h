// Commit queue and the commit thread, the only user of the store. It commits all queued effects in one transaction,
// then sends their messages and replies. Between two transactions it reads a piece of a film.
#pragma once

#include <cstddef>
#include <deque>
#include <functional>
#include <set>
#include <thread>
#include <vector>

#include "common/base/histogram.h"
#include "common/base/mutex.h"
#include "common/base/status.h"
#include "server/domain/effects.h"
#include "server/store/store.h"

namespace lightmill {

/// Called from the commit thread when effects are durable, or with the error.
using CommitReply = std::function<void(const Status&)>;

/// Request to read a film. `reply` is called once, from the commit thread.
struct FilmRead {
  JobId job;
  std::function<void(Result<StoredFilm>)> reply;
};

/// Effects are committed, sent and answered in the order of push(). If no caller waits, they are collected for 0.1 s.
/// Call push() from one thread.
///
/// While the disk is full or failing, it retries commits and acknowledges nothing. The farm waits and loses nothing,
/// and callers get an error that says so. Any other error of the store means damage or a bug, and on_fatal is called. A
/// film that cannot be read now is retried too. Other read errors go to `reply`.
class CommitQueue {
 public:
  struct Handlers {
    std::function<void(Outgoing)> send;           ///< an after_commit message
    std::function<void(const Status&)> on_fatal;  ///< the store is unusable; called once
    /// The error while nothing can be stored; OK when it can again. From the commit thread.
    std::function<void(const Status&)> on_stall = [](const Status&) {};
  };
  struct Batch {
    std::vector<StoreOp> writes;
    std::vector<Outgoing> after_commit;
    std::vector<CommitReply>
        replies;  ///< called before `after_commit` is sent, so that no answer to a message comes sooner
    /// Like `replies`, for callers that do not wait forever. RESOURCE_EXHAUSTED tells them that the commit takes
    /// longer. The effects are still stored later.
    std::vector<CommitReply> callers;
    std::vector<FilmRead> reads = {};  ///< started when these and all earlier writes are durable
  };
  CommitQueue(Store& store, Handlers handlers);
  ~CommitQueue();

  /// Blocks while kMaxQueuedWrites are queued.
  void push(Batch batch);

  /// Times of commits, with their retries. Thread-safe.
  Histogram seconds() const;

  /// From now on a failing commit is not retried, and later ones fail too.
  void stop_retrying();
  /// Commits what is queued, and ends the thread. Returns the first error, if anything could not be stored.
  Status stop();

 private:
  /// A request whose film is being read, or waits to be read.
  struct Reading {
    FilmRead read;
    FilmPosition after = {};
    StoredFilm nodes = {};
  };
  void run();
  bool idle();
  /// Bytes that the queue keeps for one more write.
  std::uint64_t added_bytes(const StoreOp& op) LM_REQUIRES(mutex_);
  bool read_is_due() const { return !readings_.empty() && std::chrono::steady_clock::now() >= next_read_; }
  void read_piece();
  Status commit_with_retries(const std::vector<StoreOp>& writes, std::vector<CommitReply>& callers);
  void notify_callers(std::vector<CommitReply>& callers, const Status& stall);
  void finish(Batch& batch, const Status& status);

  Store& store_;
  const Handlers handlers_;
  mutable Mutex mutex_;
  CondVar changed_;
  Batch queued_ LM_GUARDED_BY(mutex_);
  std::uint64_t queued_bytes_ LM_GUARDED_BY(mutex_) = 0;
  std::set<JobId> queued_jobs_ LM_GUARDED_BY(mutex_);  ///< whose scenes are in queued_bytes_
  bool urgent_ LM_GUARDED_BY(mutex_) = false;          ///< a caller waits for queued effects
  bool stopping_ LM_GUARDED_BY(mutex_) = false;
  bool retrying_ LM_GUARDED_BY(mutex_) = true;
  Status failure_ LM_GUARDED_BY(mutex_);
  Histogram seconds_ LM_GUARDED_BY(mutex_);
  std::deque<Reading> readings_;                       ///< only for the commit thread
  std::chrono::steady_clock::time_point next_read_{};  ///< only for the commit thread
  std::thread thread_;
};

}  // namespace lightmill
