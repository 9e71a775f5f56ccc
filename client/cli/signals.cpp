#include "client/cli/signals.h"

#include <pthread.h>
#include <unistd.h>

namespace lightmill::cli {
namespace {

constexpr int kStopSignal = SIGUSR2;  // sent only to the watching thread, to end it
constexpr int kInterruptedExit = 130;

bool ignored(int signal) {
  struct sigaction action {};
  sigaction(signal, nullptr, &action);
  return action.sa_handler == SIG_IGN;
}

}  // namespace

Signals::Signals() {
  sigemptyset(&watched_);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    if (!ignored(signal)) {
      sigaddset(&watched_, signal);
    }
  }
  sigaddset(&watched_, SIGCHLD);
  sigaddset(&watched_, kStopSignal);
  pthread_sigmask(SIG_BLOCK, &watched_, nullptr);
  std::signal(SIGPIPE, SIG_IGN);  // a closed pipe is a write error instead
  thread_ = std::thread([this] { watch(); });
}

Signals::~Signals() {
  {
    const MutexLock lock(mutex_);
    stopping_ = true;
  }
  pthread_kill(thread_.native_handle(), kStopSignal);
  thread_.join();
}

bool Signals::interrupted() const {
  const MutexLock lock(mutex_);
  return interrupted_;
}

bool Signals::interrupted_by_user() const {
  const MutexLock lock(mutex_);
  return by_user_;
}

void Signals::sleep(Duration duration) {
  const auto until = std::chrono::steady_clock::now() + duration;
  const MutexLock lock(mutex_);
  const std::uint64_t before = events_;
  while (!interrupted_ && events_ == before && changed_.wait_until(mutex_, until) == std::cv_status::no_timeout) {
  }
}

void Signals::on_event(std::function<void()> callback) {
  const MutexLock lock(callback_mutex_);
  callback_ = std::move(callback);
}

void Signals::before_exit(std::function<void()> callback) {
  const MutexLock lock(callback_mutex_);
  before_exit_ = std::move(callback);
}

void Signals::watch() {
  for (;;) {
    int signal = 0;
    sigwait(&watched_, &signal);
    bool at_once = false;
    {
      const MutexLock lock(mutex_);
      if (stopping_) {
        return;
      }
      at_once = signal == SIGINT && interrupted_;
      by_user_ = by_user_ || signal == SIGINT;
      interrupted_ = interrupted_ || signal == SIGINT || signal == SIGTERM || signal == SIGHUP;
      ++events_;
      changed_.notify_all();
    }
    const MutexLock lock(callback_mutex_);
    if (at_once) {
      if (before_exit_) {
        before_exit_();
      }
      ::_exit(kInterruptedExit);
    }
    if (callback_) {
      callback_();
    }
  }
}

}  // namespace lightmill::cli
