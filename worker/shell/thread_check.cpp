#include "worker/shell/thread_check.h"

#include <latch>
#include <system_error>
#include <thread>
#include <vector>

namespace lightmill {

Status check_threads(std::uint32_t count) {
  std::latch all(1);
  std::vector<std::jthread> threads;
  Status status;
  try {
    for (std::uint32_t i = 0; i < count; ++i) {
      threads.emplace_back([&] { all.wait(); });
    }
  } catch (const std::system_error& error) {
    status = resource_exhausted(
        "only {} of the {} threads that this worker needs can start ({}): run it with fewer --threads, or raise the "
        "limit of its tasks (ulimit -u, pids.max, TasksMax) or of its memory (ulimit -v)",
        threads.size(), count, error.what());
  }
  all.count_down();
  return status;
}

}  // namespace lightmill
