// The thread that makes steps durable: all that wait go into one transaction, then their messages and replies go out.
#pragma once

#include <cstddef>
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

/// Steps are committed, told of, sent and answered in the order in which they were pushed; those that nobody waits for
/// gather for a tenth of a second. push() from one thread.
///
/// While the disk is full or failing, commits are tried again and nothing is acknowledged: the farm waits and loses
/// nothing, and callers are told so. Any other error of the store means damage or a bug, and on_fatal is called.
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
  void run();
  bool idle();
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
  std::thread thread_;
};

}  // namespace lightmill
