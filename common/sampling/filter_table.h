// Importance sampling of a one-dimensional, symmetric pixel filter by its tabulated inverse distribution.
#pragma once

#include <functional>
#include <vector>

#include "common/math/simd.h"

namespace lightmill {

/// Maps a uniform number to an offset whose density is proportional to the filter. The inverse of the cumulative
/// distribution is piecewise linear with kCells cells. The density is constant within a cell. Offsets are accurate to
/// 1/kCells of the radius.
class FilterTable {
 public:
  static constexpr int kCells = 1024;

  /// The filter is `density(x)` for |x| <= radius. It must be non-negative, symmetric and not zero everywhere.
  FilterTable(double radius, const std::function<double(double)>& density);

  /// Offsets in [-radius, radius] for u in [0, 1).
  F8 sample(F8 u) const {
    const F8 scaled = u * F8(static_cast<float>(kCells));
    const U8 cell = truncate(scaled);
    const F8 a = gather(inverse_.data(), cell, M8(true));
    const F8 b = gather(inverse_.data() + 1, cell, M8(true));
    return a + (b - a) * (scaled - to_float(cell));
  }

  float radius() const { return inverse_.back(); }
  /// The density of `sample`, as tabulated; 0 from the radius on.
  float density(float x) const;

 private:
  std::vector<float> inverse_;  ///< kCells + 1 offsets at equal probabilities
};

}  // namespace lightmill
