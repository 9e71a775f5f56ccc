// Signals as values: Ctrl-C, SIGTERM, SIGHUP and the death of a child, waited for by a thread of their own.
//
// Construct one first thing in main, before other threads start: it blocks these signals in the thread that makes it,
// and threads started later inherit that. Signals that the process was told to ignore (nohup) stay ignored. A second
// Ctrl-C ends the process at once.
#pragma once

#include <csignal>

#include <functional>
#include <thread>

#include "common/base/clock.h"
#include "common/base/mutex.h"

namespace lightmill::cli {

class Signals {
 public:
  Signals();
  ~Signals();
  Signals(const Signals&) = delete;
  Signals& operator=(const Signals&) = delete;

  /// Whether the user, or the system, has asked the process to end.
  bool interrupted() const;
  /// Whether it was the user, by Ctrl-C.
  bool interrupted_by_user() const;
  /// Sleeps, but not past an interruption or a child's death.
  void sleep(Duration duration);
  /// Called from the watching thread at each interruption and each child's death; empty: nothing is called. When this
  /// returns, no call of the old one is running.
  void on_event(std::function<void()> callback);
  /// Called from the watching thread before a second Ctrl-C ends the process; empty: nothing is called.
  void before_exit(std::function<void()> callback);

 private:
  void watch();

  sigset_t watched_{};
  mutable Mutex mutex_;
  Mutex callback_mutex_;  ///< held while one of the callbacks runs
  CondVar changed_;
  bool interrupted_ LM_GUARDED_BY(mutex_) = false;
  bool by_user_ LM_GUARDED_BY(mutex_) = false;
  bool stopping_ LM_GUARDED_BY(mutex_) = false;
  std::uint64_t events_ LM_GUARDED_BY(mutex_) = 0;
  std::function<void()> callback_ LM_GUARDED_BY(callback_mutex_);
  std::function<void()> before_exit_ LM_GUARDED_BY(callback_mutex_);
  std::thread thread_;
};

}  // namespace lightmill::cli
