#include "server/runtime/farm_watchdog.h"

#include "common/base/log.h"

namespace lightmill {

FarmWatchdog::FarmWatchdog(FarmLoop& loop, std::function<void(bool)> on_change, Duration timeout, Duration pause)
    : loop_(loop),
      on_change_(std::move(on_change)),
      timeout_(timeout),
      pause_(pause),
      shared_(std::make_shared<Shared>()),
      thread_([this] { run(); }) {}

FarmWatchdog::~FarmWatchdog() {
  {
    const MutexLock lock(shared_->mutex);
    shared_->stopping = true;
    shared_->changed.notify_all();
  }
  thread_.join();
}

void FarmWatchdog::ask() {
  {
    const MutexLock lock(shared_->mutex);
    shared_->answered = false;
  }
  loop_.post_always([shared = shared_](const FarmLoop::TaskContext&) {
    const MutexLock lock(shared->mutex);
    shared->answered = true;
    shared->changed.notify_all();
  });
}

bool FarmWatchdog::wait(Duration time, bool for_answer) {
  const auto until = std::chrono::steady_clock::now() + time;
  const MutexLock lock(shared_->mutex);
  while (!shared_->stopping && !(for_answer && shared_->answered) &&
         shared_->changed.wait_until(shared_->mutex, until) == std::cv_status::no_timeout) {
  }
  return !shared_->stopping;
}

bool FarmWatchdog::answered() {
  const MutexLock lock(shared_->mutex);
  return shared_->answered;
}

void FarmWatchdog::run() {
  bool answers = true;
  ask();
  while (wait(timeout_, true)) {
    if (const bool answers_now = answered(); answers_now != answers) {
      answers = answers_now;
      if (answers) {
        spdlog::info("the coordinator answers calls again");
      } else {
        spdlog::error(
            "the farm thread has not answered for {:.3g} s. Health checks say NOT_SERVING until it does. Check the "
            "load and the disk of this machine",
            to_seconds(timeout_));
      }
      on_change_(answers);
    }
    if (answers) {
      if (!wait(pause_, false)) {
        return;
      }
      ask();
    }
  }
}

}  // namespace lightmill
