#include "server/runtime/demand_hub.h"

namespace lightmill {

std::optional<Time> DemandHub::publish(const Coordinator& farm, Time now) {
  std::erase_if(listeners_, [](const Listener& listener) { return listener.sink->closed(); });
  if (listeners_.empty()) {
    return std::nullopt;
  }
  if (now < next_check_) {
    return next_check_;
  }
  next_check_ = now + kInterval;
  const bool active = farm.wants_workers();
  for (Listener& listener : listeners_) {
    // A stream that is still writing calls FarmLoop::wake when it is done.
    if (listener.sent != active && listener.sink->writable()) {
      listener.sent = active;
      listener.sink->offer(active);
    }
  }
  return std::nullopt;
}

}  // namespace lightmill
