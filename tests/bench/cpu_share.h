// Limiter of a process to a share of a core, whatever else the machine does.
#pragma once

#include <signal.h>
#include <sys/types.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <thread>

#include "common/base/check.h"
#include "tests/bench/measure.h"

namespace lightmill {

/// CPU seconds that a process has used.
inline double process_cpu_seconds(pid_t pid) {
  clockid_t clock;
  LM_CHECK(clock_getcpuclockid(pid, &clock) == 0, "process {} has ended", pid);
  return seconds_of(clock);
}

/// Holds a process to a share of a core while it exists. It stops the process when the share is used up.
class CpuShare {
 public:
  CpuShare(pid_t pid, double share)
      : pid_(pid), share_(share), thread_([this](const std::stop_token& stop) { hold(stop); }) {}
  ~CpuShare() {
    thread_.request_stop();
    thread_.join();
    ::kill(pid_, SIGCONT);
  }
  CpuShare(const CpuShare&) = delete;
  CpuShare& operator=(const CpuShare&) = delete;
  void change(double share) { share_ = share; }

 private:
  static constexpr double kMaxSaved = 0.02;  // CPU seconds that an idle process may use at once

  void hold(const std::stop_token& stop) const {
    using SteadyClock = std::chrono::steady_clock;
    double allowed = process_cpu_seconds(pid_);
    bool stopped = false;
    for (auto last = SteadyClock::now(); !stop.stop_requested();) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
      const auto now = SteadyClock::now();
      const double used = process_cpu_seconds(pid_);
      allowed = std::min(allowed + share_ * std::chrono::duration<double>(now - last).count(), used + kMaxSaved);
      last = now;
      if (stopped != (used > allowed)) {
        stopped = !stopped;
        ::kill(pid_, stopped ? SIGSTOP : SIGCONT);
      }
    }
  }

  const pid_t pid_;
  std::atomic<double> share_;
  std::jthread thread_;
};

}  // namespace lightmill
