// Choice of the cheapest method from a pilot's measurements.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace lightmill {

/// Measurements of one method by two independent batches with equally many samples.
struct PilotMeasure {
  std::array<double, 2> variance{};  ///< relative variance of one sample: trimmed mean over pixels of var/(r² + 0.01)
  std::array<double, 2> cost{};      ///< of one sample (counted_cost.h)
  std::array<double, 2> light{};     ///< light found: mean over pixels of value/√(r² + 0.01)
  std::array<double, 2> light_variance{};
  double inefficiency(std::size_t batch) const { return variance[batch] * cost[batch]; }
};

/// Threshold for missed light. A method is excluded if it found less light than another one on both batches. The
/// difference must exceed this share, and three of its standard deviations. Such a method finds some light only by rare
/// chance, so its measured variance means nothing. With normal distributions and independent pixels the chance of a
/// false exclusion is below two in a million. Pixels of photon methods share passes.
inline constexpr double kMissedLight = 0.01;
/// A method other than the simplest must need this many times less work, on both batches.
inline constexpr double kClearGain = 1.2;

struct PilotChoice {
  std::size_t choice = 0;            ///< index of the method
  std::vector<std::string> reasons;  ///< the measurements, for users
};

/// The simplest of the methods that missed no light, or a clearly cheaper one. `measures` has one entry per method, at
/// least one, simplest first. `methods` are their names.
PilotChoice choose(std::span<const std::string> methods, std::span<const PilotMeasure> measures);

/// The mean without the largest 0.1 % of the values (at least one, if there are several). Reorders them.
double trimmed_mean(std::span<double> values);

}  // namespace lightmill
