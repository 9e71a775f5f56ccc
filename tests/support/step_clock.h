// A clock that moves only when the test says so.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>

#include "common/base/clock.h"

namespace lightmill::test {

/// Thread-safe.
class StepClock final : public Clock {
 public:
  Time now() const override { return Time(Duration(since_begin_ns_)); }
  std::int64_t unix_milliseconds() const override { return 0; }
  void pass(Duration time) { since_begin_ns_ += time.count(); }

 private:
  std::atomic<Duration::rep> since_begin_ns_ = Duration(std::chrono::seconds(1000)).count();
};

}  // namespace lightmill::test
