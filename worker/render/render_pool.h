// The threads that render tiles.
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

/// CPU time of one thread since this was made by it. Others may read it while the thread lives.
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
  std::uint64_t ticket = 0;  ///< given back with the tile
  SampleRange range;
  PixelRect rect;
  std::shared_ptr<const Method> method;
};

/// Takes tasks in order, but those of first samples before others, as a picture waits for them; `done` is called from
/// the threads. Who adds bounds the queue (the session: two per thread).
class RenderPool {
 public:
  using Done = std::function<void(RenderedTile)>;
  /// Changes a node before it is hashed.
  using Tamper = std::function<void(Node&)>;
  /// std::system_error if a thread cannot start.
  RenderPool(std::uint32_t threads, Done done, Tamper tamper = {});
  /// Stops the tiles under way; what waits is dropped.
  ~RenderPool();

  void add(RenderTask task);
  /// Ends a task that waits or is under way soon: its node has no values then. Does nothing for one that is done.
  void stop(std::uint64_t ticket);
  /// Tickets that threads work on, and for how many seconds of their CPU time.
  std::vector<std::pair<std::uint64_t, double>> at_work() const;

 private:
  struct State {
    std::stop_source stop;
    std::optional<CpuClock> cpu;  ///< once a thread works on it
  };
  void run();
  void end();

  const Done done_;
  const Tamper tamper_;
  mutable Mutex mutex_;
  CondVar changed_;
  std::deque<RenderTask> tasks_ LM_GUARDED_BY(mutex_);
  std::map<std::uint64_t, State> states_ LM_GUARDED_BY(mutex_);  ///< by ticket, of tasks that are not done
  bool stopping_ LM_GUARDED_BY(mutex_) = false;
  std::vector<std::thread> threads_;
};

}  // namespace lightmill
