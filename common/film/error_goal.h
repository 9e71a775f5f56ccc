// Sample counts at which a job with an error goal reads its error, and whether the goal is met.
//
// The error is read only where every tile has exactly its share (allocation.h) of 2^k or 3·2^k samples. So the samples
// of a finished film follow from scene, settings and goal, and for an extended job from its earlier count. The order of
// results does not affect them.
#pragma once

#include <cstdint>

#include "common/film/allocation.h"
#include "common/film/error_estimate.h"

namespace lightmill {

/// Fewest samples per pixel of a tile at which the error is read. Each half has eight then.
inline constexpr std::uint64_t kFirstErrorCount = 16;

/// The frame's first count at which its error is read: 16, 32 or 64. Every tile has kFirstErrorCount then, also those
/// with the smallest share.
inline std::uint64_t first_error_count(const Allocation& allocation) {
  return kFirstErrorCount << -allocation.least_shift();
}

/// The next count from `samples` on at which the error is read: 16, 24, 32, 48, 64, 96, … from `first` on. At most
/// 2·kMaxSamples.
std::uint64_t next_error_count(std::uint64_t samples, std::uint64_t first = kFirstErrorCount);

/// Whether the error is at most `goal`, including the confidence interval.
inline bool meets(const FrameError& error, double goal) {
  return error.known && error.rel_mse + error.half_width <= goal;
}

/// The count at which a frame that has `error` at `samples` will probably meet `goal`, because errors fall as
/// 1/samples. At most 2·kMaxSamples. `error` must be known, and `goal` positive.
std::uint64_t expected_error_count(const FrameError& error, double samples, double goal,
                                   std::uint64_t first = kFirstErrorCount);

}  // namespace lightmill
