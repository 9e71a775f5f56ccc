// SIGINT and SIGTERM as calls on an ordinary thread.
#pragma once

#include <functional>
#include <thread>

namespace lightmill {

/// Takes SIGINT and SIGTERM away from the process's threads and reports them. Make it first in main, before any thread:
/// a thread started earlier could still be hit. SIGPIPE is ignored from then on.
class StopSignals {
 public:
  /// `handler(count)` is called from a thread of its own for the first, second, … signal.
  explicit StopSignals(std::function<void(int count)> handler);
  ~StopSignals();
  StopSignals(const StopSignals&) = delete;
  StopSignals& operator=(const StopSignals&) = delete;

 private:
  std::thread thread_;
};

}  // namespace lightmill
