// Requests that gRPC reads into memory: a limited number at a time, which callers share.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <unordered_map>
#include <vector>

#include "common/base/clock.h"
#include "common/base/mutex.h"
#include "common/base/status.h"
#include "server/access/slot_pool.h"

namespace lightmill {

class RequestReads;

/// The error of a call that gets no turn, or takes too long in it while others wait.
inline Status too_many_requests() {
  return resource_exhausted("too many large or slow requests at a time: send fewer of them at once");
}

/// The turns of one call, one for each message that it reads. Thread-safe.
class ReadTurn : public std::enable_shared_from_this<ReadTurn> {
 public:
  /// Made by RequestReads::add.
  ReadTurn(RequestReads& reads, Holder holder, std::function<void()> read, std::function<void()> give_up)
      : reads_(reads), holder_(std::move(holder)), read_(std::move(read)), give_up_(std::move(give_up)) {}

  /// The call wants to read its next message. Its last turn has ended. False if too many wait: it gets no turn.
  bool begin();
  /// The message was read, or the call ends. The call's functions are not called from now on. Returns whether `read` was
  /// not called in this turn.
  bool end();

 private:
  friend class RequestReads;
  enum class State { idle, waiting, reading };
  void start();
  void evict();

  RequestReads& reads_;
  const Holder holder_;
  const std::function<void()> read_, give_up_;
  // Used with the mutex of `reads_`.
  SlotPool::Id id_ = 0;
  State state_ = State::idle;
  Mutex mutex_;
  bool ended_ LM_GUARDED_BY(mutex_) = true;
  bool read_called_ LM_GUARDED_BY(mutex_) = false;
};

/// Thread-safe. Must outlive its turns.
class RequestReads {
 public:
  /// Limits of messages that are read at a time, and that wait. One caller has half of each at most.
  RequestReads(std::size_t most_read, std::size_t most_waiting, const Clock& clock)
      : clock_(clock), most_waiting_(most_waiting), pool_(most_read, (most_read + 1) / 2) {}

  /// `read` is called when a turn comes, at once or later, from any thread. `give_up` is called if the message is not
  /// there after SlotPool::kTimeout while others wait, or if another caller has fewer turns. Both must not block.
  std::shared_ptr<ReadTurn> add(const Holder& holder, std::function<void()> read, std::function<void()> give_up) {
    return std::make_shared<ReadTurn>(*this, holder, std::move(read), std::move(give_up));
  }

 private:
  friend class ReadTurn;
  /// Turns that begin, and turns that end for them.
  struct Changes {
    std::vector<std::shared_ptr<ReadTurn>> started, evicted;
    void add(Changes more);
  };
  Changes start_next() LM_REQUIRES(mutex_);
  /// Whether no more of this holder may wait.
  bool is_full_for(const Holder& holder) const LM_REQUIRES(mutex_);
  static void run(const Changes& changes);

  const Clock& clock_;
  const std::size_t most_waiting_;
  Mutex mutex_;
  SlotPool pool_ LM_GUARDED_BY(mutex_);
  SlotPool::Id next_id_ LM_GUARDED_BY(mutex_) = 1;
  std::unordered_map<SlotPool::Id, std::shared_ptr<ReadTurn>> reading_ LM_GUARDED_BY(mutex_);
  /// By age.
  std::map<Holder, std::map<SlotPool::Id, std::shared_ptr<ReadTurn>>> waiting_ LM_GUARDED_BY(mutex_);
  std::size_t waiting_count_ LM_GUARDED_BY(mutex_) = 0;
};

}  // namespace lightmill
