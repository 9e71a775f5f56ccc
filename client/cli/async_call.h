// A call to a farm on a thread of its own. It can be cancelled.
#pragma once

#include <functional>
#include <future>
#include <utility>

#include "common/base/clock.h"
#include "common/base/status.h"

namespace lightmill::cli {

/// Runs during its lifetime. The destructor does not wait for a silent coordinator.
template <class Answer>
class AsyncCall {
 public:
  /// `ask` runs on the thread. `cancel` ends the calls that `ask` has in progress, but not those about to begin.
  AsyncCall(std::function<Result<Answer>()> ask, std::function<void()> cancel)
      : cancel_(std::move(cancel)), answer_(std::async(std::launch::async, std::move(ask))) {}
  /// Cancels the call.
  ~AsyncCall() {
    // Repeated, because a call that is about to begin misses a cancellation.
    while (answer_.valid() && !done(kCancelEvery)) {
      cancel_();
    }
  }
  AsyncCall(const AsyncCall&) = delete;
  AsyncCall& operator=(const AsyncCall&) = delete;

  /// Whether the answer arrived, or arrives within `timeout`.
  bool done(Duration timeout = {}) const { return answer_.wait_for(timeout) == std::future_status::ready; }
  /// The answer. Call once.
  Result<Answer> result() { return answer_.get(); }

 private:
  static constexpr Duration kCancelEvery = std::chrono::milliseconds(10);
  const std::function<void()> cancel_;
  std::future<Result<Answer>> answer_;
};

}  // namespace lightmill::cli
