// SIGINT and SIGTERM as calls on an ordinary thread.
#pragma once

#include <functional>
#include <thread>

namespace lightmill {

/// Blocks SIGINT and SIGTERM in the process's threads, and reports them. Create it first in main: a thread that started
/// earlier could still receive them. Also ignores SIGPIPE.
class StopSignals {
 public:
  /// Calls `handler(count)` from a thread of its own for the first, second, … signal.
  explicit StopSignals(std::function<void(int count)> handler);
  ~StopSignals();
  StopSignals(const StopSignals&) = delete;
  StopSignals& operator=(const StopSignals&) = delete;

 private:
  std::thread thread_;
};

}  // namespace lightmill
