// Time points, and the clock that programs inject. Pure code gets the time as an argument.
#pragma once

#include <chrono>
#include <cstdint>

namespace lightmill {

using Duration = std::chrono::nanoseconds;

/// A time point of a steady clock. Only differences have a meaning.
using Time = std::chrono::time_point<struct LightmillTimeline, Duration>;

inline double to_seconds(Duration d) {
  return std::chrono::duration<double>(d).count();
}
inline Duration from_seconds(double seconds) {
  return std::chrono::duration_cast<Duration>(std::chrono::duration<double>(seconds));
}

/// The time source of a program. Thread-safe.
class Clock {
 public:
  virtual ~Clock() = default;
  virtual Time now() const = 0;                        ///< Monotonic.
  virtual std::int64_t unix_milliseconds() const = 0;  ///< Wall clock, for people to read. It may jump.
};

/// The machine's clocks.
const Clock& system_clock();

}  // namespace lightmill
