// Finds the deposits near a point: a hash grid, sorted by counting.
#pragma once

#include <span>
#include <vector>

#include "common/methods/photons/deposit.h"

namespace lightmill::photons {

/// Immutable once built; what it finds, and in which order, is a function of the deposits and the cell's size alone.
class DepositMap {
 public:
  DepositMap() = default;
  /// Of the deposits with these numbers. `cell` is the side of a cell, in lengths of the frame; positive.
  DepositMap(std::span<const Deposit> deposits, std::span<const std::uint32_t> chosen, float cell);

  bool empty() const { return entries_.empty(); }
  /// Appends the numbers of the deposits that are nearer than `radius`; costs (2 + 2·radius/cell)³ cells at most.
  void find(const Vec3& p, float radius, std::vector<std::uint32_t>& out) const;
  std::uint64_t bytes() const { return entries_.size() * sizeof(Entry) + first_.size() * 4; }

 private:
  struct Entry {
    std::uint64_t cell;  ///< two cells may share a bucket
    Vec3 point;
    std::uint32_t deposit;
  };
  std::int64_t coordinate(float x) const;
  std::size_t bucket(std::uint64_t cell) const;

  float inverse_cell_ = 1;
  std::vector<std::uint32_t> first_;  ///< by bucket, a power of two of them, and the end
  std::vector<Entry> entries_;
};

}  // namespace lightmill::photons
