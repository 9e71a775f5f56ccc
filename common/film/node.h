// Node: a worker's result for one tile and one sample range, which the film merges.
#pragma once

#include <cmath>
#include <cstdint>
#include <vector>

#include "common/base/digest.h"
#include "common/film/layers.h"
#include "common/film/sample_range.h"

namespace lightmill {

/// Sums over one sample range, per pixel, channel and half.
///
/// `values[(half * channels + channel) * pixels + pixel]`, with pixels row by row in the tile's rectangle. Half 0 (A)
/// sums even sample indices, half 1 (B) odd ones. Each sum is a binary tree over ascending indices (pairwise summation
/// in float32), so a node has the bits of its joined children. Values are at most largest_value() and never −0. Layers
/// that are not summed follow, if any (see NodeLayout).
struct Node {
  SampleRange range;
  std::vector<float> values;
  std::uint64_t non_finite = 0;  ///< samples that were NaN or infinite, and counted as zero
};

/// Largest absolute value of one sample. kMaxSamples of these do not overflow, also when both halves are added.
inline constexpr float kLargestSample = 0x1p97f;
/// Largest absolute value in a node of this range. Each of its sums has one sample, or half of the range's.
inline float largest_value(const SampleRange& range) {
  return std::ldexp(kLargestSample, range.level == 0 ? 0 : static_cast<int>(range.level) - 1);
}

/// Joins two siblings. `left` has the lower indices. Adds corresponding values, and joins layers that are not summed as
/// NodeLayout describes.
Node join(const Node& left, const Node& right, const NodeLayout& layout = {});

/// XXH3-128 of a node: its range, count of non-finite samples and values, as little-endian bytes.
Hash128 hash_of(const Node& node);

}  // namespace lightmill
