// Wait before a worker is given again what it has failed at again and again.
#pragma once

#include <algorithm>
#include <cstdint>

#include "common/base/clock.h"

namespace lightmill {

/// Nothing after the first time. Half a second after the second time, twice as long after each further one, half a
/// minute at most.
inline Duration repeat_wait(std::uint32_t times) {
  constexpr Duration kLeast = std::chrono::milliseconds(500), kMost = std::chrono::seconds(32);
  return times < 2 ? Duration::zero() : std::min(kLeast * (1 << std::min(times - 2, 16u)), kMost);
}

}  // namespace lightmill
