// How much of the light of groups of lights arrives where, learned from samples.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "common/math/vec.h"

namespace lightmill {

/// Estimates of the visibility of each group, by cell of a grid. Immutable once built.
///
/// A cell with v visible of n tested samples has the estimate (v + 8 e)/(n + 8), where e is that of the smallest cell
/// around it that has more samples. Cells are twice as long as those within them. The cell of all samples has
/// (v + 1/2)/(n + 1). The grid leaves out the farthest samples, which have the estimates of the nearest cells.
class LightVisibility {
 public:
  static constexpr std::size_t kMaxGroups = 32;

  /// A shading point, and the groups whose light was tested there and arrived, as bits.
  struct Sample {
    Vec3 point;
    std::uint32_t tested = 0, visible = 0;
  };

  LightVisibility() = default;
  LightVisibility(std::span<const Sample> samples, std::size_t groups);

  bool empty() const { return estimates_.empty(); }
  /// The row of the estimates at a point.
  U8 row(const V8& p) const;
  F8 at(U8 row, std::size_t group) const {
    return gather(estimates_.data() + group, row * U8(static_cast<std::uint32_t>(groups_)), M8(true));
  }
  std::uint64_t bytes() const { return 4 * (rows_.size() + estimates_.size()); }

 private:
  struct Builder;
  /// The estimate around a cell counts as much as this number of samples.
  static constexpr float kSamplesAround = 8;
  /// Estimates are not smaller, so that sums of products with bounds of lights are normal numbers.
  static constexpr float kLeast = 1e-4f;
  /// Share of the samples that lie beyond the grid, on each side of each axis.
  static constexpr double kBeyond = 0.02;
  static constexpr int kLevels = 5;
  static constexpr std::uint32_t kCells = 1u << kLevels;  ///< along the longest side

  std::array<U8, 3> cell(const V8& p) const;

  std::size_t groups_ = 0;
  Vec3 low_{0};
  float cells_per_length_ = 0;
  std::array<std::uint32_t, 3> size_{};  ///< cells along each axis
  std::vector<std::uint32_t> rows_;      ///< by cell, x first
  std::vector<float> estimates_;         ///< by row and group
};

}  // namespace lightmill
