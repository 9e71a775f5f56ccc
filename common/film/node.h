// Node: a worker's result for one tile and one sample range, which the film merges.
#pragma once

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
/// in float32), so a node has the bits of its joined children. Values are finite and never −0. Layers that are not
/// summed follow, if any (see NodeLayout).
struct Node {
  SampleRange range;
  std::vector<float> values;
  std::uint64_t non_finite = 0;  ///< samples that were NaN or infinite, and counted as zero
};

/// Joins two siblings. `left` has the lower indices. Adds corresponding values, and joins layers that are not summed as
/// NodeLayout describes.
Node join(const Node& left, const Node& right, const NodeLayout& layout = {});

/// XXH3-128 of a node: its range, count of non-finite samples and values, as little-endian bytes.
Hash128 hash_of(const Node& node);

}  // namespace lightmill
