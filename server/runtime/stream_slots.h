// Slots for long calls: each kind has a limited number, which callers share.
#pragma once

#include <array>
#include <functional>
#include <memory>
#include <unordered_map>

#include "common/base/mutex.h"
#include "common/base/status.h"
#include "server/access/call_limits.h"
#include "server/access/slot_pool.h"

namespace lightmill {

enum class StreamKind {
  asset,   ///< uploads and downloads
  film,    ///< downloads of films; each keeps the nodes of its film in memory
  watch,   ///< watches of jobs over gRPC
  scaler,  ///< streams of autoscalers
  page,    ///< pages that are open in a browser
  count
};

/// Kind of a call. None if it is short, or has its own limits, as workers' streams have.
std::optional<StreamKind> stream_kind(const Rpc& rpc);

class StreamSlots;

/// Slot of one call, freed at its end. Thread-safe.
class StreamSlot {
 public:
  StreamSlot(StreamSlots& slots, StreamKind kind, SlotPool::Id id) : slots_(slots), kind_(kind), id_(id) {}
  ~StreamSlot();
  StreamSlot(const StreamSlot&) = delete;
  StreamSlot& operator=(const StreamSlot&) = delete;

  /// Sets what ends the call when another needs its slot. Called at most once, from any thread. It must not block.
  void on_evict(std::function<void()> end);
  /// The slot is free, and `end` is not called from now on. A stream calls it before it sends its last status: its
  /// caller may begin the next call at once.
  void call_ended();
  /// The call waits for its caller from now on, until set_active().
  void set_stalled();
  void set_active();

 private:
  friend class StreamSlots;
  void evict();

  StreamSlots& slots_;
  const StreamKind kind_;
  const SlotPool::Id id_;
  Mutex mutex_;
  std::function<void()> end_ LM_GUARDED_BY(mutex_);
  bool evicted_ LM_GUARDED_BY(mutex_) = false;
};

/// Thread-safe. Must outlive its slots.
class StreamSlots {
 public:
  StreamSlots(const CallLimitOptions& options, const Clock& clock);

  /// RESOURCE_EXHAUSTED.
  Result<std::shared_ptr<StreamSlot>> take(StreamKind kind, const Holder& holder);

  static constexpr std::size_t kMaxFilms = 64, kMaxWatches = 1'000, kMaxScalers = 1'000, kMaxPages = 256;

 private:
  friend class StreamSlot;
  struct Kind {
    SlotPool slots;
    std::size_t most, of_caller;
    std::unordered_map<SlotPool::Id, std::weak_ptr<StreamSlot>> held = {};
  };
  Kind kind_of(std::size_t most) const;
  Kind& of(StreamKind kind) LM_REQUIRES(mutex_) { return kinds_[static_cast<std::size_t>(kind)]; }

  const CallLimitOptions options_;
  const Clock& clock_;
  Mutex mutex_;
  SlotPool::Id next_id_ LM_GUARDED_BY(mutex_) = 1;
  std::array<Kind, static_cast<std::size_t>(StreamKind::count)> kinds_ LM_GUARDED_BY(mutex_);
};

}  // namespace lightmill
