// Simulated world: time, events in order, chance, and counts of faults.
//
// One seed determines everything. The sides of the farm (server_side.h, worker_side.h, client_side.h) schedule actions
// and report failures here.
#pragma once

#include <fmt/format.h>

#include <functional>
#include <optional>
#include <queue>
#include <string>
#include <vector>

#include "tests/simulation/chaos.h"
#include "tests/simulation/random.h"

namespace lightmill::simulation {

using Action = std::function<void()>;

class World {
 public:
  World(std::uint64_t seed, const Chaos& chaos, const PlantedBugs& bugs) : random(seed), chaos(chaos), bugs(bugs) {}

  void at(Time time, Action action) { events_.push({std::max(time, now), next_order_++, std::move(action)}); }
  void after(Duration delay, Action action) { at(now + delay, std::move(action)); }
  /// Runs the next event. False if there is none.
  bool run_next();

  bool chaos_now() const { return now < chaos_end; }
  /// Random time before the end of chaos.
  Time some_time() { return now + from_seconds(random.uniform() * to_seconds(chaos_end - now)); }
  std::int64_t unix_ms() const;
  /// Reports a failure. Only the first is kept.
  void fail(std::string what);
  /// Counts a fault.
  void inject(const std::string& kind);
  template <class... Args>
  void trace(fmt::format_string<Args...> format, Args&&... args) const {
    if (traced) {
      fmt::print("{:9.4f}  {}\n", to_seconds(now.time_since_epoch()), fmt::format(format, std::forward<Args>(args)...));
    }
  }

  Time now{std::chrono::seconds(100)};
  Time chaos_end = now;
  Random random;
  Chaos chaos;
  PlantedBugs bugs;
  std::optional<Race> race;
  Report report;
  bool traced = false;

 private:
  struct Event {
    Time time;
    std::uint64_t order;
    Action action;
    bool operator>(const Event& other) const { return std::tie(time, order) > std::tie(other.time, other.order); }
  };
  std::uint64_t next_order_ = 0;
  std::priority_queue<Event, std::vector<Event>, std::greater<>> events_;
};

}  // namespace lightmill::simulation
