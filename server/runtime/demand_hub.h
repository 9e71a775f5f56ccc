// Who wants to know whether the farm could use workers, and hears it whenever that changes.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "common/base/clock.h"
#include "server/domain/coordinator.h"

namespace lightmill {

/// The stream to one listener. Thread-safe.
class DemandSink {
 public:
  virtual ~DemandSink() = default;
  virtual bool closed() const = 0;
  /// Whether the last answer has left, so that another may be offered.
  virtual bool writable() const = 0;
  virtual void offer(bool active) = 0;
};

/// Not thread-safe; belongs to the farm thread. Looks twice a second at most, however much happens, as a look goes
/// through all jobs.
class DemandHub {
 public:
  static constexpr Duration kInterval = std::chrono::milliseconds(500);

  void add(std::shared_ptr<DemandSink> sink) { listeners_.push_back({std::move(sink), std::nullopt}); }
  /// Tells what is new; returns when to call again if nothing else happens.
  std::optional<Time> publish(const Coordinator& farm, Time now);

 private:
  struct Listener {
    std::shared_ptr<DemandSink> sink;
    std::optional<bool> told;
  };
  std::vector<Listener> listeners_;
  Time next_look_{};
};

}  // namespace lightmill
