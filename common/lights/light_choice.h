// Choice of one of the scene's lights, and its probability.
#pragma once

#include <optional>
#include <span>

#include "common/lights/light_bvh.h"
#include "common/sampling/discrete.h"

namespace lightmill {

/// Up to this many lights are chosen by power alone, more by a BVH (light_bvh.h), whose cost does not pay for few
/// lights.
inline constexpr std::size_t kMostLightsByPower = 16;

/// Bounded lights have the first numbers, infinitely distant ones the next. Immutable once built.
class LightChoice {
 public:
  LightChoice() = default;
  /// All powers must be positive. Those of distant lights are fluxes through the whole scene.
  LightChoice(std::span<const LightBounds> bounded, std::span<const double> distant_powers);

  /// There is one light at most.
  bool trivial() const { return count_ <= 1; }
  /// Whether `sample` uses its second number.
  bool needs_second_number() const { return tree_.has_value(); }

  struct Choice8 {
    U8 light;
    F8 pmf;  ///< 0 if no light can shine on the point
  };
  Choice8 sample(const V8& p, Pair8 u) const;
  /// The probability that `sample` returns a light, with the same bits.
  F8 pmf(const V8& p, U8 light, M8 lanes) const;
  std::uint64_t bytes() const { return 16 * by_power_.size() + (tree_ ? tree_->bytes() : 0); }

 private:
  std::size_t count_ = 0, bounded_ = 0;
  /// Over all lights. With a BVH: over the BVH (entry 0) and the distant lights.
  DiscreteDistribution by_power_;
  std::vector<float> pmf_;    ///< of by_power_'s entries, for gathers
  std::vector<float> first_;  ///< sums of pmf_ below an entry
  std::optional<LightBvh> tree_;
};

}  // namespace lightmill
