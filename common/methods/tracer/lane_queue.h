// Queue of eight-lane structs, stored as a structure of arrays.
#pragma once

#include <vector>

#include "common/math/vec.h"

namespace lightmill {

/// Appends the lanes of a mask next to each other, in order, so that loads have full lanes. `Row8` has only eight-lane
/// numbers. The last `kOptional` of them are stored only if reserve() asks for them. Otherwise they load as 0. Not
/// thread-safe.
template <class Row8, std::size_t kOptional = 0>
class LaneQueue {
 public:
  static constexpr std::size_t kColumns = sizeof(Row8) / sizeof(F8), kAlways = kColumns - kOptional;
  static_assert(sizeof(Row8) == kColumns * sizeof(F8) && std::is_trivially_copyable_v<Row8>);

  /// Makes room for `rows`, and for the end of the last push.
  void reserve(std::size_t rows, bool optional = true) {
    optional_ = optional;
    stride_ = rows + 16;  // loads and stores are eight wide
    values_.resize(kColumns * stride_);
  }
  int size() const { return size_; }
  void clear() { size_ = 0; }

  /// The eight rows from `i` on.
  Row8 load(int i) const {
    Row8 row;
    auto* const lanes = reinterpret_cast<float*>(&row);
    const float* const from = values_.data() + i;
#pragma GCC unroll 32
    for (std::size_t column = 0; column < kAlways; ++column) {
      F8::load(from + column * stride_).store(lanes + 8 * column);
    }
    for (std::size_t column = kAlways; optional_ && column < kColumns; ++column) {
      F8::load(from + column * stride_).store(lanes + 8 * column);
    }
    return row;
  }
  void push(M8 lanes, const Row8& row) {
    const int bits = lanes.bits();
    const U8 order = compress_order(bits);
    const auto* const from = reinterpret_cast<const float*>(&row);
    float* const to = values_.data() + size_;
#pragma GCC unroll 32
    for (std::size_t column = 0; column < kAlways; ++column) {
      permute(F8::load(from + 8 * column), order).store(to + column * stride_);
    }
    for (std::size_t column = kAlways; optional_ && column < kColumns; ++column) {
      permute(F8::load(from + 8 * column), order).store(to + column * stride_);
    }
    size_ += std::popcount(static_cast<unsigned>(bits));
  }

 private:
  int size_ = 0;
  bool optional_ = true;
  std::size_t stride_ = 0;
  std::vector<float> values_;  ///< column by column
};

}  // namespace lightmill
