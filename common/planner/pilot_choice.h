// Which of several methods is the cheapest, from what a pilot has measured of them.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace lightmill {

/// Of one method, by two independent batches of equally many samples.
struct PilotMeasure {
  std::array<double, 2> variance{};  ///< relative, of one sample: trimmed mean over pixels of var/(r² + 0.01)
  std::array<double, 2> cost{};      ///< of one sample (counted_cost.h)
  std::array<double, 2> light{};     ///< all that was found: mean over pixels of value/√(r² + 0.01)
  std::array<double, 2> light_variance{};
  double inefficiency(std::size_t batch) const { return variance[batch] * cost[batch]; }
};

/// On both batches a method has found less light than another one by more than this share of it, and by more than three
/// times the standard deviation of the difference (of normal distribution, that happens by chance less than twice in a
/// million, if pixels share nothing; those of photon methods share passes): it takes by rare chance what the other one
/// finds, so that the variance that it shows is none to go by.
inline constexpr double kMissedLight = 0.01;
/// A method other than the simplest must need this many times less work, on both batches.
inline constexpr double kClearGain = 1.2;

struct PilotChoice {
  std::size_t choice = 0;            ///< index of the method
  std::vector<std::string> reasons;  ///< what was measured, for people
};

/// The simplest of the methods that have not missed light, or what is clearly cheaper. One measure a method, at least
/// one, the simplest first; `methods` are their names.
PilotChoice choose(std::span<const std::string> methods, std::span<const PilotMeasure> measures);

/// The mean of values without the worst 0.1 % of them (at least one, of more than one); reorders them.
double trimmed_mean(std::span<double> values);

}  // namespace lightmill
