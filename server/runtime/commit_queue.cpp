#include "server/runtime/commit_queue.h"

#include <malloc.h>

#include <algorithm>
#include <array>

#include "common/base/log.h"
#include "server/store/coalesce.h"

namespace lightmill {
namespace {

/// Beyond one of these limits, the farm thread waits for the disk. One batch may be larger, because it has all effects
/// that came during the last commit.
constexpr std::size_t kMaxQueuedWrites = 2'000;
constexpr std::uint64_t kMaxQueuedBytes = std::uint64_t{128} << 20;
constexpr auto kRetryPause = std::chrono::seconds(1);
/// Effects without a waiting caller are collected for this time. This gives fewer, larger transactions.
constexpr auto kGatherTime = std::chrono::milliseconds(100);
constexpr std::size_t kGatherWrites = 200;
/// Bounds of the histogram, in seconds.
constexpr std::array kCommitBounds{0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 5.0, 10.0, 60.0};

bool worth_retrying(const Status& status) {
  return status.code() == StatusCode::kResourceExhausted || status.code() == StatusCode::kUnavailable;
}

/// Whether a client waits for these effects, or a worker for another message than an acknowledgement.
bool is_urgent(const CommitQueue::Batch& batch) {
  return !batch.replies.empty() || !batch.callers.empty() || !batch.reads.empty() ||
         std::ranges::any_of(batch.writes, [](const StoreOp& op) { return std::holds_alternative<PutJob>(op); }) ||
         std::ranges::any_of(batch.after_commit,
                             [](const Outgoing& each) { return !std::holds_alternative<ResultAck>(each.message); });
}

bool is_empty(const CommitQueue::Batch& batch) {
  return batch.writes.empty() && batch.after_commit.empty() && batch.replies.empty() && batch.callers.empty() &&
         batch.reads.empty();
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
    : store_(store), handlers_(std::move(handlers)), seconds_(kCommitBounds), thread_([this] { run(); }) {}

CommitQueue::~CommitQueue() {
  if (thread_.joinable()) {
    (void)stop();
  }
}

void CommitQueue::push(Batch batch) {
  if (is_empty(batch)) {
    return;
  }
  const MutexLock lock(mutex_);
  while (queued_.writes.size() >= kMaxQueuedWrites || queued_bytes_ >= kMaxQueuedBytes) {
    changed_.wait(mutex_);
  }
  for (const StoreOp& op : batch.writes) {
    queued_bytes_ += added_bytes(op);
  }
  const bool was_empty = is_empty(queued_);
  urgent_ = urgent_ || is_urgent(batch);
  append(queued_.writes, std::move(batch.writes));
  append(queued_.after_commit, std::move(batch.after_commit));
  append(queued_.replies, std::move(batch.replies));
  append(queued_.callers, std::move(batch.callers));
  append(queued_.reads, std::move(batch.reads));
  // The commit thread wakes for the first effects, and then only for urgent or many ones.
  if (was_empty || urgent_ || queued_.writes.size() >= kGatherWrites) {
    changed_.notify_all();
  }
}

/// Values of nodes, and scenes. Rows of one job share its scene.
std::uint64_t CommitQueue::added_bytes(const StoreOp& op) {
  if (const auto* const node = std::get_if<PutNode>(&op)) {
    return node->node->values.size() * sizeof(float);
  }
  const auto* const job = std::get_if<PutJob>(&op);
  const bool is_new = job != nullptr && queued_jobs_.insert(job->record.id).second;
  return is_new ? job->record.spec.settings.scene->size() : 0;
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

Histogram CommitQueue::seconds() const {
  const MutexLock lock(mutex_);
  return seconds_;
}

bool CommitQueue::idle() {
  const MutexLock lock(mutex_);
  return is_empty(queued_) && readings_.empty() && !stopping_;
}

void CommitQueue::run() {
  for (;;) {
    while (idle() && store_.tidy()) {
    }
    Batch batch;
    Status failure;
    {
      const MutexLock lock(mutex_);
      while (is_empty(queued_) && (stopping_ || !read_is_due())) {
        if (stopping_) {
          return;
        }
        if (readings_.empty()) {
          changed_.wait(mutex_);
        } else {
          changed_.wait_until(mutex_, next_read_);
        }
      }
      const auto until = std::chrono::steady_clock::now() + kGatherTime;
      while (!urgent_ && readings_.empty() && queued_.writes.size() < kGatherWrites && !stopping_ &&
             changed_.wait_until(mutex_, until) == std::cv_status::no_timeout) {
      }
      batch = std::exchange(queued_, {});
      queued_bytes_ = 0;
      queued_jobs_.clear();
      urgent_ = false;
      failure = failure_;
      changed_.notify_all();
    }
    // After a failure nothing more is written, because later effects depend on the lost ones.
    if (failure.ok() && !batch.writes.empty()) {
      const auto begun = std::chrono::steady_clock::now();
      failure = commit_with_retries(coalesce(std::move(batch.writes)), batch.callers);
      const MutexLock lock(mutex_);
      seconds_.add(std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count());
    }
    finish(batch, failure);
    for (FilmRead& read : batch.reads) {
      readings_.push_back({std::move(read)});
    }
    if (read_is_due()) {
      read_piece();
    }
  }
}

void CommitQueue::read_piece() {
  Reading& reading = readings_.front();
  if (reading.nodes.empty()) {
    ::malloc_trim(0);  // freed memory of dropped films may be in the heaps of other threads
  }
  Result<FilmPiece> piece = store_.read_film(reading.read.job, reading.after);
  if (!piece.ok() && worth_retrying(piece.status())) {
    spdlog::debug("cannot read the film of job {} now: {}. It is retried", reading.read.job.value,
                  message_of(piece.status()));
    next_read_ = std::chrono::steady_clock::now() + kRetryPause;
    return;
  }
  if (piece.ok()) {
    append(reading.nodes, std::move(piece->nodes));
    if (piece->last) {
      reading.after = *piece->last;
      return;
    }
  }
  reading.read.reply(piece.ok() ? Result<StoredFilm>(std::move(reading.nodes)) : piece.status());
  readings_.pop_front();
}

/// Also the callers of queued effects.
void CommitQueue::notify_callers(std::vector<CommitReply>& callers, const Status& stall) {
  {
    const MutexLock lock(mutex_);
    append(callers, std::exchange(queued_.callers, {}));
  }
  for (const CommitReply& caller : std::exchange(callers, {})) {
    caller(
        resource_exhausted("the farm has accepted this, but cannot store it yet: {}. It will be done when it can be "
                           "stored: do not repeat the request",
                           message_of(stall)));
  }
}

Status CommitQueue::commit_with_retries(const std::vector<StoreOp>& writes, std::vector<CommitReply>& callers) {
  bool stalled = false;
  for (;;) {
    const Status status = store_.commit(writes);
    if (status.ok()) {
      if (stalled) {
        spdlog::info("the store can be written again");
        handlers_.on_stall(ok_status());
      }
      return status;
    }
    if (!stalled) {
      spdlog::error("cannot store progress: {}. Results are not acknowledged until it can be stored",
                    message_of(status));
      stalled = true;
      if (worth_retrying(status)) {
        handlers_.on_stall(status);
      }
    }
    if (worth_retrying(status)) {
      notify_callers(callers, status);
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
  const Status outcome = status.ok() ? status : unavailable("the farm cannot store this now: {}", message_of(status));
  for (const CommitReply& reply : batch.replies) {
    reply(outcome);
  }
  if (status.ok()) {
    for (Outgoing& message : batch.after_commit) {
      handlers_.send(std::move(message));
    }
  }
  for (const CommitReply& reply : batch.callers) {
    reply(outcome);
  }
}

}  // namespace lightmill
