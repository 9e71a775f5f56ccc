// Pool of threads that render tiles.
#pragma once

#include <time.h>

#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <stop_token>
#include <thread>
#include <utility>
#include <vector>

#include "common/base/mutex.h"
#include "common/methods/method.h"
#include "worker/session/session.h"

namespace lightmill {

/// CPU time of one thread since the thread constructed this clock. Other threads may read it while the thread lives.
class CpuClock {
 public:
  CpuClock();
  double seconds() const { return now() - begun_; }

 private:
  double now() const;
  clockid_t clock_ = {};
  double begun_ = 0;
};

struct RenderTask {
  std::uint64_t ticket = 0;  ///< returned with the tile
  SampleRange range;
  PixelRect rect;
  std::shared_ptr<const Method> method;
};

/// Runs tasks in order. Tasks with first samples go before others, because a picture waits for them. The threads call
/// `done`. The caller bounds the queue. (The session queues at most two tasks per thread.)
class RenderPool {
 public:
  using Done = std::function<void(RenderedTile)>;
  /// For tests: changes a node before it is hashed.
  using Tamper = std::function<void(Node&)>;
  /// std::system_error if a thread cannot start.
  RenderPool(std::uint32_t threads, Done done, Tamper tamper = {});
  /// Stops the current tiles, and drops waiting tasks.
  ~RenderPool();

  void add(RenderTask task);
  /// Cancels a task. It ends soon, and its node has no values. Does nothing for a completed task.
  void stop(std::uint64_t ticket);
  /// Tickets that threads work on, and the CPU seconds spent on each.
  std::vector<std::pair<std::uint64_t, double>> at_work() const;

 private:
  struct State {
    std::stop_source stop;
    std::optional<CpuClock> cpu;  ///< set once a thread works on it
  };
  void run();
  void end();

  const Done done_;
  const Tamper tamper_;
  mutable Mutex mutex_;
  CondVar changed_;
  std::deque<RenderTask> tasks_ LM_GUARDED_BY(mutex_);
  std::map<std::uint64_t, State> states_ LM_GUARDED_BY(mutex_);  ///< unfinished tasks, by ticket
  bool stopping_ LM_GUARDED_BY(mutex_) = false;
  std::vector<std::thread> threads_;
};

}  // namespace lightmill
