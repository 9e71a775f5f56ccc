// Signals as values: Ctrl-C, SIGTERM, SIGHUP and the death of a child. A thread of its own waits for them.
//
// Construct one at the start of main, before other threads. It blocks these signals in its thread, and later threads
// inherit this. Signals that are ignored at the start (nohup) stay ignored. A second Ctrl-C ends the process at
// once.
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

  /// Whether the user or the system asked the process to end.
  bool interrupted() const;
  /// Whether the user did, by Ctrl-C.
  bool interrupted_by_user() const;
  /// Sleeps until an interruption or a child's death at the latest.
  void sleep(Duration duration);
  /// Sets what the watching thread calls at each interruption and each child's death. An empty callback is allowed.
  /// When this returns, no call of the old one is running.
  void on_event(std::function<void()> callback);
  /// Sets what the watching thread calls before a second Ctrl-C ends the process. An empty callback is allowed.
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
