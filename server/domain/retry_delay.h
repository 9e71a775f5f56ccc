// Wait before a worker gets work again at which it has failed before (exponential backoff).
#pragma once

#include <algorithm>
#include <cstdint>

#include "common/base/clock.h"

namespace lightmill {

/// Zero after the first failure, 0.5 s after the second, then twice as long after each further one, at most 32 s.
inline Duration retry_delay(std::uint32_t times) {
  constexpr Duration kLeast = std::chrono::milliseconds(500), kMost = std::chrono::seconds(32);
  return times < 2 ? Duration::zero() : std::min(kLeast * (1 << std::min(times - 2, 16u)), kMost);
}

}  // namespace lightmill
