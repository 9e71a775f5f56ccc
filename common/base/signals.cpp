#include "common/base/signals.h"

#include <pthread.h>
#include <signal.h>

namespace lightmill {
namespace {

/// Ends the waiting thread. Only this class sends it.
constexpr int kQuit = SIGUSR2;

sigset_t watched_signals() {
  sigset_t set;
  sigemptyset(&set);
  sigaddset(&set, SIGINT);
  sigaddset(&set, SIGTERM);
  sigaddset(&set, kQuit);
  return set;
}

}  // namespace

StopSignals::StopSignals(std::function<void(int)> handler) {
  ::signal(SIGPIPE, SIG_IGN);
  const sigset_t set = watched_signals();
  pthread_sigmask(SIG_BLOCK, &set, nullptr);
  thread_ = std::thread([set, handler = std::move(handler)] {
    for (int count = 1;; ++count) {
      int number = 0;
      if (sigwait(&set, &number) != 0 || number == kQuit) {
        return;
      }
      handler(count);
    }
  });
}

StopSignals::~StopSignals() {
  pthread_kill(thread_.native_handle(), kQuit);
  thread_.join();
}

}  // namespace lightmill
