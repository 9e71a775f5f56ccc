#include "server/runtime/farm_pulse.h"

#include "common/base/log.h"

namespace lightmill {

FarmPulse::FarmPulse(FarmLoop& loop, std::function<void(bool)> on_change, Duration patience, Duration pause)
    : loop_(loop),
      on_change_(std::move(on_change)),
      patience_(patience),
      pause_(pause),
      shared_(std::make_shared<Shared>()),
      thread_([this] { run(); }) {}

FarmPulse::~FarmPulse() {
  {
    const MutexLock lock(shared_->mutex);
    shared_->stopping = true;
    shared_->changed.notify_all();
  }
  thread_.join();
}

void FarmPulse::ask() {
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

bool FarmPulse::wait(Duration time, bool for_answer) {
  const auto until = std::chrono::steady_clock::now() + time;
  const MutexLock lock(shared_->mutex);
  while (!shared_->stopping && !(for_answer && shared_->answered) &&
         shared_->changed.wait_until(shared_->mutex, until) == std::cv_status::no_timeout) {
  }
  return !shared_->stopping;
}

bool FarmPulse::answered() {
  const MutexLock lock(shared_->mutex);
  return shared_->answered;
}

void FarmPulse::run() {
  bool beats = true;
  ask();
  while (wait(patience_, true)) {
    if (const bool beats_now = answered(); beats_now != beats) {
      beats = beats_now;
      if (beats) {
        spdlog::info("the coordinator answers calls again");
      } else {
        spdlog::error("the coordinator has answered no call for {:.3g} s: health checks report this",
                      to_seconds(patience_));
      }
      on_change_(beats);
    }
    if (beats) {
      if (!wait(pause_, false)) {
        return;
      }
      ask();
    }
  }
}

}  // namespace lightmill
