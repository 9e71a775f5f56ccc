#include "common/sampling/piecewise_2d.h"

#include <bit>

#include "common/base/check.h"
#include "common/sampling/discrete.h"

namespace lightmill {
namespace {

struct Found8 {
  U8 index;
  F8 low, high;  ///< cumulative probabilities at its ends
};

/// The largest i < count with sums[first + i] <= u.
Found8 find(const std::vector<float>& sums, U8 first, std::size_t count, F8 u) {
  const M8 all(true);
  U8 low(0u);
  U8 high(static_cast<std::uint32_t>(count - 1));
  for (int step = std::bit_width(count - 1); step > 0; --step) {
    const U8 middle = (low + high + U8(1u)) >> 1;
    const M8 right = gather(sums.data(), first + middle, all) <= u;
    low = select(right, middle, low);
    high = select(right, high, middle - U8(1u));
  }
  return {low, gather(sums.data(), first + low, all), gather(sums.data() + 1, first + low, all)};
}

/// The cell of a coordinate in [0, 1].
U8 cell_of(F8 x, std::size_t count) {
  const U8 cell = truncate(max(x * F8(static_cast<float>(count)), F8(0.0f)));
  const U8 last(static_cast<std::uint32_t>(count - 1));
  return select(signed_less(last, cell), last, cell);
}

}  // namespace

PiecewiseConstant2D::PiecewiseConstant2D(std::span<const double> weights, std::size_t width, std::size_t height)
    : width_(width), height_(height) {
  LM_CHECK(width > 0 && height > 0 && weights.size() == width * height);
  std::vector<double> row_sums;
  columns_.reserve(height * (width + 1));
  for (std::size_t row = 0; row < height; ++row) {
    row_sums.push_back(append_cumulative(weights.subspan(row * width, width), columns_));
  }
  LM_CHECK(append_cumulative(row_sums, rows_) > 0);
}

PiecewiseConstant2D::Sample8 PiecewiseConstant2D::sample(Pair8 u) const {
  const Found8 row = find(rows_, U8(0u), height_, u.v);
  const U8 first = row.index * U8(static_cast<std::uint32_t>(width_ + 1));
  const Found8 column = find(columns_, first, width_, u.u);
  const auto within = [](const Found8& found, F8 at, std::size_t count) {
    const F8 part = (at - found.low) / (found.high - found.low);
    return (to_float(found.index) + min(part, F8(1 - 0x1p-20f))) * F8(1.0f / static_cast<float>(count));
  };
  const F8 cells(static_cast<float>(width_) * static_cast<float>(height_));
  return {within(column, u.u, width_), within(row, u.v, height_),
          (row.high - row.low) * (column.high - column.low) * cells};
}

F8 PiecewiseConstant2D::pdf(F8 x, F8 y) const {
  const M8 all(true);
  const U8 row = cell_of(y, height_);
  const U8 cell = row * U8(static_cast<std::uint32_t>(width_ + 1)) + cell_of(x, width_);
  const F8 of_row = gather(rows_.data() + 1, row, all) - gather(rows_.data(), row, all);
  const F8 in_row = gather(columns_.data() + 1, cell, all) - gather(columns_.data(), cell, all);
  return of_row * in_row * F8(static_cast<float>(width_) * static_cast<float>(height_));
}

}  // namespace lightmill
