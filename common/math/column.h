// Columns of tables in which eight lanes look up values.
#pragma once

#include <algorithm>
#include <vector>

#include "common/math/vec.h"

namespace lightmill {

/// A growing array of floats or of 32-bit integers. Up to eight values are looked up in a register. A permutation takes
/// a fraction of a gather's time.
template <class T>
class Column {
 public:
  using Lanes = std::conditional_t<std::is_same_v<T, float>, F8, U8>;

  void push_back(T value) {
    values_.resize(std::max(values_.size(), size_ + 1));
    values_[size_++] = value;
  }
  std::size_t size() const { return size_; }
  T operator[](std::size_t row) const { return values_[row]; }
  /// The values of these rows in the lanes of the mask, 0 in the others.
  Lanes at(U8 row, M8 lanes) const {
    return size_ <= 8 ? masked(lanes, permute(Lanes::load(values_.data()), row)) : gather(values_.data(), row, lanes);
  }

 private:
  std::vector<T> values_ = std::vector<T>(8);  ///< room for a register
  std::size_t size_ = 0;
};

/// A column of vectors.
class VectorColumn {
 public:
  void push_back(const Vec3& v) {
    x_.push_back(v.x);
    y_.push_back(v.y);
    z_.push_back(v.z);
  }
  V8 at(U8 row, M8 lanes) const { return {x_.at(row, lanes), y_.at(row, lanes), z_.at(row, lanes)}; }

 private:
  Column<float> x_, y_, z_;
};

}  // namespace lightmill
