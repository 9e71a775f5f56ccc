// Places for long calls: each kind has a limited number, which callers share.
#pragma once

#include <array>
#include <functional>
#include <memory>
#include <unordered_map>

#include "common/base/mutex.h"
#include "common/base/status.h"
#include "server/access/call_limits.h"
#include "server/access/places.h"

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
std::optional<StreamKind> stream_kind(Rpc rpc);

class StreamPlaces;

/// Place of one call, freed at its end. Thread-safe.
class StreamPlace {
 public:
  StreamPlace(StreamPlaces& places, StreamKind kind, Places::Id id) : places_(places), kind_(kind), id_(id) {}
  ~StreamPlace();
  StreamPlace(const StreamPlace&) = delete;
  StreamPlace& operator=(const StreamPlace&) = delete;

  /// Sets what ends the call when another needs its place. Called at most once, from any thread. It must not block.
  void on_give_way(std::function<void()> end);
  /// The call has ended. `end` is not called from now on.
  void call_ended();
  /// The call waits for its caller from now on, until moves().
  void stands_still();
  void moves();

 private:
  friend class StreamPlaces;
  void give_way();

  StreamPlaces& places_;
  const StreamKind kind_;
  const Places::Id id_;
  Mutex mutex_;
  std::function<void()> end_ LM_GUARDED_BY(mutex_);
  bool gives_way_ LM_GUARDED_BY(mutex_) = false;
};

/// Thread-safe. Must outlive its places.
class StreamPlaces {
 public:
  StreamPlaces(const CallLimitOptions& options, const Clock& clock);

  /// RESOURCE_EXHAUSTED.
  Result<std::shared_ptr<StreamPlace>> take(StreamKind kind, const Holder& holder);

  static constexpr std::size_t kMostFilms = 64, kMostWatches = 1'000, kMostScalers = 1'000, kMostPages = 256;

 private:
  friend class StreamPlace;
  struct Kind {
    Places places;
    std::size_t most, of_caller;
    std::unordered_map<Places::Id, std::weak_ptr<StreamPlace>> held = {};
  };
  Kind kind_of(std::size_t most) const;
  Kind& of(StreamKind kind) LM_REQUIRES(mutex_) { return kinds_[static_cast<std::size_t>(kind)]; }

  const CallLimitOptions options_;
  const Clock& clock_;
  Mutex mutex_;
  Places::Id next_id_ LM_GUARDED_BY(mutex_) = 1;
  std::array<Kind, static_cast<std::size_t>(StreamKind::count)> kinds_ LM_GUARDED_BY(mutex_);
};

}  // namespace lightmill
