// Watchdog of the farm thread: asks it regularly for an answer, from a thread of its own.
#pragma once

#include <functional>
#include <memory>
#include <thread>

#include "common/base/clock.h"
#include "common/base/mutex.h"
#include "server/runtime/farm_loop.h"

namespace lightmill {

class FarmWatchdog {
 public:
  /// Time between two questions, and the longest time that an answer may take. A working farm thread needs much less,
  /// because another thread waits for the store.
  static constexpr Duration kPause = std::chrono::seconds(1), kTimeout = std::chrono::seconds(10);

  /// `on_change` is called on the thread: with false when an answer takes longer than `timeout`, and with true when it
  /// comes after that.
  FarmWatchdog(FarmLoop& loop, std::function<void(bool)> on_change, Duration timeout = kTimeout,
               Duration pause = kPause);
  /// Does not wait for an answer.
  ~FarmWatchdog();
  FarmWatchdog(const FarmWatchdog&) = delete;
  FarmWatchdog& operator=(const FarmWatchdog&) = delete;

 private:
  /// A task that the farm thread has not run may outlive this object.
  struct Shared {
    Mutex mutex;
    CondVar changed;
    bool answered LM_GUARDED_BY(mutex) = true;
    bool stopping LM_GUARDED_BY(mutex) = false;
  };
  void run();
  void ask();
  /// Waits for `time` at most, or until the answer is there if one is wanted. False if the watchdog stops.
  bool wait(Duration time, bool for_answer);
  bool answered();

  FarmLoop& loop_;
  const std::function<void(bool)> on_change_;
  const Duration timeout_, pause_;
  const std::shared_ptr<Shared> shared_;
  std::thread thread_;
};

}  // namespace lightmill
