#include "tests/simulation/world.h"

namespace lightmill::simulation {

bool World::run_next() {
  if (events_.empty()) {
    return false;
  }
  const Event event = events_.top();
  events_.pop();
  now = event.time;
  event.action();
  return true;
}

std::int64_t World::unix_ms() const {
  return std::chrono::duration_cast<std::chrono::milliseconds>(now.time_since_epoch()).count();
}

void World::fail(std::string what) {
  if (report.failure.empty()) {
    report.failure = fmt::format("at {:.3f} s: {}", to_seconds(now.time_since_epoch()), what);
  }
}

void World::inject(const std::string& kind) {
  ++report.faults[kind];
  trace("injected: {}", kind);
}

}  // namespace lightmill::simulation
