// Dyadic sample ranges: [index·2^level, (index+1)·2^level).
#pragma once

#include <compare>
#include <cstdint>

namespace lightmill {

/// A dyadic, aligned range of sample indices. Two ranges are disjoint or one contains the other.
struct SampleRange {
  std::uint32_t level = 0;  ///< log2 of the number of samples; at most kMaxRangeLevel
  std::uint32_t index = 0;

  std::uint64_t first() const { return std::uint64_t{index} << level; }
  std::uint64_t count() const { return std::uint64_t{1} << level; }
  std::uint64_t end() const { return first() + count(); }
  SampleRange parent() const { return {level + 1, index >> 1}; }
  SampleRange sibling() const { return {level, index ^ 1}; }
  SampleRange left_child() const { return {level - 1, index << 1}; }
  SampleRange right_child() const { return {level - 1, (index << 1) | 1}; }
  bool contains(const SampleRange& other) const {
    return level >= other.level && (other.index >> (level - other.level)) == index;
  }
  friend auto operator<=>(const SampleRange&, const SampleRange&) = default;
};

/// Sample indices stay below 2^30.
inline constexpr std::uint32_t kMaxRangeLevel = 30;
inline constexpr std::uint64_t kMaxSamples = std::uint64_t{1} << kMaxRangeLevel;

}  // namespace lightmill
