// The thread that uses the store: it makes steps durable, all that wait in one transaction, then their messages and
// replies go out; and it reads films, a piece between two transactions.
#pragma once

#include <cstddef>
#include <deque>
#include <functional>
#include <thread>
#include <vector>

#include "common/base/histogram.h"
#include "common/base/mutex.h"
#include "common/base/status.h"
#include "server/domain/effects.h"
#include "server/store/store.h"

namespace lightmill {

/// Told once effects are durable, or why that failed. Called from the writer thread.
using CommitReply = std::function<void(const Status&)>;

/// A film to be read. `reply` is called once, from the writer thread.
struct FilmRead {
  JobId job;
  std::function<void(Result<StoredFilm>)> reply;
};

/// Steps are committed, told of, sent and answered in the order in which they were pushed; those that nobody waits for
/// gather for a tenth of a second. push() from one thread.
///
/// While the disk is full or failing, commits are tried again and nothing is acknowledged: the farm waits and loses
/// nothing, and callers are told so. Any other error of the store means damage or a bug, and on_fatal is called. A film
/// that cannot be read now is tried again, too; other errors of reading are its reader's.
class CommitQueue {
 public:
  struct Handlers {
    std::function<void(Outgoing)> send;           ///< an after_commit message
    std::function<void(const Status&)> on_fatal;  ///< the store cannot be used any more; called once
    /// Nothing can be stored now, and why; OK once it can again. From the writer thread.
    std::function<void(const Status&)> on_stall = [](const Status&) {};
  };
  struct Batch {
    std::vector<StoreOp> writes;
    std::vector<Outgoing> after_commit;
    std::vector<CommitReply> replies;  ///< before its messages leave: nothing comes of those sooner
    /// As `replies`, of those who do not wait for ever: RESOURCE_EXHAUSTED tells them that storing it takes longer. It
    /// is stored later all the same.
    std::vector<CommitReply> callers;
    std::vector<FilmRead> reads = {};  ///< once these and all earlier writes are durable
  };
  CommitQueue(Store& store, Handlers handlers);
  ~CommitQueue();

  /// Waits while kMaxQueuedWrites are queued.
  void push(Batch batch);

  /// How long commits took, with those that had to be tried again. Thread-safe.
  Histogram seconds() const;

  /// From now on a failing commit is given up instead of tried again; later ones fail too.
  void stop_retrying();
  /// Commits what is queued and ends the thread. Returns the first error, if anything could not be stored.
  Status stop();

 private:
  /// A film that is being read, or waits for that.
  struct Reading {
    FilmRead read;
    FilmPlace after = {};
    StoredFilm nodes = {};
  };
  void run();
  bool idle();
  bool read_is_due() const { return !readings_.empty() && std::chrono::steady_clock::now() >= next_read_; }
  void read_piece();
  Status commit_with_retries(const std::vector<StoreOp>& writes, std::vector<CommitReply>& callers);
  void tell_callers(std::vector<CommitReply>& callers, const Status& stall);
  void finish(Batch& batch, const Status& status);

  Store& store_;
  const Handlers handlers_;
  mutable Mutex mutex_;
  CondVar changed_;
  Batch queued_ LM_GUARDED_BY(mutex_);
  bool urgent_ LM_GUARDED_BY(mutex_) = false;  ///< somebody waits for what is queued
  bool stopping_ LM_GUARDED_BY(mutex_) = false;
  bool retrying_ LM_GUARDED_BY(mutex_) = true;
  Status failure_ LM_GUARDED_BY(mutex_);
  Histogram seconds_ LM_GUARDED_BY(mutex_);
  std::deque<Reading> readings_;                       ///< the writer thread's own
  std::chrono::steady_clock::time_point next_read_{};  ///< the writer thread's own
  std::thread thread_;
};

}  // namespace lightmill
