// When a job that asks for an error is looked at, and when it has what it asks for.
//
// The frame's error is read only where every tile has exactly its part (allocation.h) of 2^k or 3·2^k samples: so which
// samples a finished film has is a function of the scene, the settings and the goal (of an extended job, of how far it
// had come as well), never of the order in which results come.
#pragma once

#include <cstdint>

#include "common/film/allocation.h"
#include "common/film/error_estimate.h"

namespace lightmill {

/// A tile's samples per pixel below which no error is read: each half has eight then.
inline constexpr std::uint64_t kFirstErrorCount = 16;

/// The frame's first count at which its error is read: every tile has kFirstErrorCount then, also one that gets less
/// than others. 16, 32 or 64.
inline std::uint64_t first_error_count(const Allocation& allocation) {
  return kFirstErrorCount << -allocation.least_shift();
}

/// The frame's lowest count of at least `samples` at which the error is read: 16, 24, 32, 48, 64, 96, … from `first`
/// on. At most 2·kMaxSamples.
std::uint64_t next_error_count(std::uint64_t samples, std::uint64_t first = kFirstErrorCount);
inline bool is_error_count(std::uint64_t samples, std::uint64_t first = kFirstErrorCount) {
  return next_error_count(samples, first) == samples;
}

/// Whether the frame's error is at most `goal`, its confidence interval included.
inline bool meets(const FrameError& error, double goal) {
  return error.known && error.rel_mse + error.half_width <= goal;
}

/// The count at which a frame of `error` at `samples`, a count of the frame's too, will probably meet `goal`: errors
/// fall as 1/samples. At most 2·kMaxSamples; `error` is known, `goal` positive.
std::uint64_t expected_error_count(const FrameError& error, double samples, double goal,
                                   std::uint64_t first = kFirstErrorCount);

}  // namespace lightmill
