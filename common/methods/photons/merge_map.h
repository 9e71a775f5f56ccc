// Finds the deposits that are to be merged with a point: a grid for each octave of merging radii.
#pragma once

#include <span>
#include <vector>

#include "common/methods/photons/deposit_map.h"
#include "common/methods/photons/merge_radii.h"

namespace lightmill::photons {

/// Merging radii differ a thousandfold over a scene. So that a search looks through eight cells at most, none of them
/// much wider than what it asks for, a deposit is filed in the grid of each octave from which a search can reach it:
/// one, or two. Where radii change so fast from place to place that there would be more, octaves are wider. Immutable
/// once built; what it finds, and in which order, is a function of the deposits and the radii alone.
class MergeMap {
 public:
  MergeMap() = default;
  MergeMap(std::span<const Deposit> deposits, const MergeRadii& radii);

  bool empty() const { return octaves_.empty(); }
  /// Appends the numbers of the deposits that are nearer than the merging radius, which is that at `p`.
  void find(const Vec3& p, float radius, std::vector<std::uint32_t>& out) const;
  std::uint64_t bytes() const;

 private:
  std::size_t octave(float radius) const;

  std::vector<float> limits_;  ///< by octave: its largest radius
  std::vector<DepositMap> octaves_;
};

}  // namespace lightmill::photons
