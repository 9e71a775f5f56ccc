// A question to a farm that is asked on a thread of its own, and can be broken off.
#pragma once

#include <functional>
#include <future>
#include <utility>

#include "common/base/clock.h"
#include "common/base/status.h"

namespace lightmill::cli {

/// Asks while it lives; its end does not wait for a coordinator that is silent.
template <class Answer>
class Looking {
 public:
  /// `ask` runs on the thread. `cancel` ends the calls that `ask` has under way; it misses those that are about to
  /// begin.
  Looking(std::function<Result<Answer>()> ask, std::function<void()> cancel)
      : cancel_(std::move(cancel)), answer_(std::async(std::launch::async, std::move(ask))) {}
  /// Breaks it off.
  ~Looking() {
    // Again and again, because a call that is about to begin does not hear of it.
    while (answer_.valid() && !done(kCancelEvery)) {
      cancel_();
    }
  }
  Looking(const Looking&) = delete;
  Looking& operator=(const Looking&) = delete;

  /// Whether the answer is there now, or within so long.
  bool done(Duration patience = {}) const { return answer_.wait_for(patience) == std::future_status::ready; }
  /// The answer, once.
  Result<Answer> result() { return answer_.get(); }

 private:
  static constexpr Duration kCancelEvery = std::chrono::milliseconds(10);
  const std::function<void()> cancel_;
  std::future<Result<Answer>> answer_;
};

}  // namespace lightmill::cli
