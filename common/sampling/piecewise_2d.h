// Piecewise constant density on a grid over the unit square, sampled by inverting its cumulative sums.
#pragma once

#include <span>
#include <vector>

#include "common/math/simd.h"
#include "common/sampling/sobol.h"

namespace lightmill {

/// Probabilities of rows, and of cells within a row, are multiples of 2^-24. So `pdf` is exactly the density that
/// 24-bit numbers draw. Cells of probability zero are never drawn.
class PiecewiseConstant2D {
 public:
  PiecewiseConstant2D() = default;
  /// weights[row][column] are integrals over the cells, non-negative, with a positive sum. Fewer than 2^30 cells.
  PiecewiseConstant2D(std::span<const double> weights, std::size_t width, std::size_t height);

  struct Sample8 {
    F8 x, y;  ///< in [0, 1]
    F8 pdf;   ///< per area of the unit square
  };
  /// u.v chooses the row, and u.u the position in it.
  Sample8 sample(Pair8 u) const;

  /// The density at a point of [0, 1]².
  F8 pdf(F8 x, F8 y) const;

 private:
  std::size_t width_ = 0, height_ = 0;
  std::vector<float> rows_;     ///< cumulative probabilities below row i: height + 1
  std::vector<float> columns_;  ///< the same within each row: height · (width + 1)
};

}  // namespace lightmill
