// Demand hub: tells its listeners whether the farm can use workers, and when this changes.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "common/base/clock.h"
#include "server/domain/coordinator.h"

namespace lightmill {

/// Stream to one listener. Thread-safe.
class DemandSink {
 public:
  virtual ~DemandSink() = default;
  /// Whether the stream has ended. Asked at least once a second.
  virtual bool closed() = 0;
  /// Whether the last answer was sent, so that another can be offered.
  virtual bool writable() const = 0;
  virtual void offer(bool active) = 0;
};

/// Not thread-safe: only for the farm thread. It asks the coordinator at most twice a second, because that visits all
/// jobs.
class DemandHub {
 public:
  static constexpr Duration kInterval = std::chrono::milliseconds(500);

  void add(std::shared_ptr<DemandSink> sink) { listeners_.push_back({std::move(sink), std::nullopt}); }
  /// Tells listeners what changed. Returns when to call again if no event comes.
  std::optional<Time> publish(const Coordinator& farm, Time now);

 private:
  struct Listener {
    std::shared_ptr<DemandSink> sink;
    std::optional<bool> sent;
  };
  std::vector<Listener> listeners_;
  Time next_check_{};
};

}  // namespace lightmill
