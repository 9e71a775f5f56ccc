#include "common/film/error_goal.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "common/film/sample_range.h"

namespace lightmill {

std::uint64_t next_error_count(std::uint64_t samples, std::uint64_t first) {
  samples = std::clamp(samples, first, 2 * kMaxSamples);
  const std::uint64_t power = std::bit_ceil(samples);
  const std::uint64_t between = power / 4 * 3;
  return samples <= between ? between : power;
}

std::uint64_t expected_error_count(const FrameError& error, double samples, double goal, std::uint64_t first) {
  const double most = 2 * static_cast<double>(kMaxSamples);
  const double wanted = samples * (error.rel_mse + error.half_width) / goal;
  return next_error_count(static_cast<std::uint64_t>(wanted < most ? std::ceil(std::max(wanted, 0.0)) : most), first);
}

}  // namespace lightmill
