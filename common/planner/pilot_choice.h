// Which of several methods is the cheapest, from what a pilot has measured of them.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace lightmill {

/// What a batch of samples has cost, counted and not timed, so that every machine counts the same.
struct CountedWork {
  std::uint64_t closest_hit_rays = 0;
  std::uint64_t shadow_rays = 0;
};
/// In units of one closest-hit ray.
double cost_of(const CountedWork& work);

/// Of one method, by two independent batches of equally many samples.
struct PilotMeasure {
  std::array<double, 2> variance{};  ///< relative, of one sample: trimmed mean over pixels of var/(r² + 0.01)
  std::array<double, 2> cost{};      ///< of one sample
  double inefficiency(std::size_t batch) const { return variance[batch] * cost[batch]; }
};

/// A method other than the first, which is the simplest, must need this many times less work, on both batches.
inline constexpr double kClearGain = 1.2;

struct PilotChoice {
  std::size_t choice = 0;            ///< index of the method
  std::vector<std::string> reasons;  ///< what was measured, for people
};

/// One measure a method, at least one; `methods` are their names.
PilotChoice choose(std::span<const std::string> methods, std::span<const PilotMeasure> measures);

/// The mean of values without the worst 0.1 % of them (at least one, of more than one); reorders them.
double trimmed_mean(std::span<double> values);

}  // namespace lightmill
