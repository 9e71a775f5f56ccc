#include "server/api/commit_queue.h"

#include "common/base/log.h"
#include "server/store/coalesce.h"

namespace lightmill {
namespace {

/// A node is 96 KiB: some 100 MiB at most wait for the disk.
constexpr std::size_t kMaxQueuedWrites = 2'000;
constexpr auto kRetryPause = std::chrono::seconds(1);
/// Progress that nobody waits for gathers so long: fewer, larger transactions.
constexpr auto kGatherTime = std::chrono::milliseconds(100);
constexpr std::size_t kGatherWrites = 200;

bool worth_retrying(const Status& status) {
  return status.code() == StatusCode::kResourceExhausted || status.code() == StatusCode::kUnavailable;
}

/// Whether somebody waits for the step: a client, or a worker for something else than an acknowledgement.
bool is_urgent(const std::vector<StoreOp>& writes, const std::vector<Outgoing>& after_commit,
               const std::vector<CommitReply>& replies) {
  return !replies.empty() || std::any_of(writes.begin(), writes.end(), [](const StoreOp& op) {
    return std::holds_alternative<PutJob>(op);
  }) || std::any_of(after_commit.begin(), after_commit.end(), [](const Outgoing& each) {
    return !std::holds_alternative<ResultAck>(each.message);
  });
}

template <class T>
void append(std::vector<T>& to, std::vector<T>&& from) {
  if (to.empty()) {
    to = std::move(from);
  } else {
    to.insert(to.end(), std::make_move_iterator(from.begin()), std::make_move_iterator(from.end()));
  }
}

}  // namespace

CommitQueue::CommitQueue(Store& store, Handlers handlers)
    : store_(store), handlers_(std::move(handlers)), thread_([this] { run(); }) {}

CommitQueue::~CommitQueue() {
  if (thread_.joinable()) {
    (void)stop();
  }
}

void CommitQueue::push(std::vector<StoreOp> writes, std::vector<Outgoing> after_commit,
                       std::vector<CommitReply> replies) {
  if (writes.empty() && after_commit.empty() && replies.empty()) {
    return;
  }
  const MutexLock lock(mutex_);
  while (queued_.writes.size() >= kMaxQueuedWrites) {
    changed_.wait(mutex_);
  }
  const bool was_empty = queued_.writes.empty() && queued_.after_commit.empty() && queued_.replies.empty();
  urgent_ = urgent_ || is_urgent(writes, after_commit, replies);
  append(queued_.writes, std::move(writes));
  append(queued_.after_commit, std::move(after_commit));
  append(queued_.replies, std::move(replies));
  // The writer wakes for the first step, and then only for what need not gather any longer.
  if (was_empty || urgent_ || queued_.writes.size() >= kGatherWrites) {
    changed_.notify_all();
  }
}

void CommitQueue::stop_retrying() {
  const MutexLock lock(mutex_);
  retrying_ = false;
  changed_.notify_all();
}

Status CommitQueue::stop() {
  {
    const MutexLock lock(mutex_);
    stopping_ = true;
    retrying_ = false;
    changed_.notify_all();
  }
  thread_.join();
  const MutexLock lock(mutex_);
  return failure_;
}

void CommitQueue::run() {
  for (;;) {
    Batch batch;
    Status failure;
    {
      const MutexLock lock(mutex_);
      while (queued_.writes.empty() && queued_.after_commit.empty() && queued_.replies.empty()) {
        if (stopping_) {
          return;
        }
        changed_.wait(mutex_);
      }
      const auto until = std::chrono::steady_clock::now() + kGatherTime;
      while (!urgent_ && queued_.writes.size() < kGatherWrites && !stopping_ &&
             changed_.wait_until(mutex_, until) == std::cv_status::no_timeout) {
      }
      batch = std::exchange(queued_, {});
      urgent_ = false;
      failure = failure_;
      changed_.notify_all();
    }
    // After a failure nothing more is written: later steps build on the lost one.
    if (failure.ok() && !batch.writes.empty()) {
      failure = commit_with_retries(coalesce(std::move(batch.writes)));
    }
    finish(batch, failure);
  }
}

Status CommitQueue::commit_with_retries(const std::vector<StoreOp>& writes) {
  bool told = false;
  for (;;) {
    const Status status = store_.commit(writes);
    if (status.ok()) {
      if (told) {
        spdlog::info("the store can be written again");
        handlers_.on_stall(ok_status());
      }
      return status;
    }
    if (!told) {
      spdlog::error("cannot store progress, nothing is acknowledged until it can: {}", message_of(status));
      told = true;
      if (worth_retrying(status)) {
        handlers_.on_stall(status);
      }
    }
    bool fatal = false;
    {
      const MutexLock lock(mutex_);
      const auto until = std::chrono::steady_clock::now() + kRetryPause;
      while (worth_retrying(status) && retrying_ && changed_.wait_until(mutex_, until) == std::cv_status::no_timeout) {
      }
      if (worth_retrying(status) && retrying_) {
        continue;
      }
      failure_ = status;
      fatal = true;
    }
    if (fatal) {
      handlers_.on_fatal(status);
      return status;
    }
  }
}

void CommitQueue::finish(Batch& batch, const Status& status) {
  if (status.ok()) {
    for (Outgoing& message : batch.after_commit) {
      handlers_.send(std::move(message));
    }
  }
  for (const CommitReply& reply : batch.replies) {
    reply(status.ok() ? status : unavailable("the farm cannot store this now: {}", message_of(status)));
  }
}

}  // namespace lightmill
