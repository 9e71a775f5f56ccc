// A node: what a worker returns for one tile and one sample range, and what the film merges.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/base/digest.h"
#include "common/film/layers.h"
#include "common/film/sample_range.h"

namespace lightmill {

/// Sums over one sample range, per pixel, channel and half.
///
/// `values[(half * channels + channel) * pixels + pixel]`, pixels row by row within the tile's rectangle; half 0 (A)
/// sums the even sample indices, half 1 (B) the odd ones. Each sum is the binary tree over its indices in ascending
/// order (pairwise summation in float32), so a node has exactly the bits of joining its children. Values are finite and
/// never −0. Layers that are not summed follow where there are any: see NodeLayout.
struct Node {
  SampleRange range;
  std::vector<float> values;
  std::uint64_t non_finite = 0;  ///< Samples that were NaN or infinite and counted as zero.
};

/// Joins two siblings, `left` with the lower indices: the sums of corresponding values; of layers that are not summed,
/// what NodeLayout says.
Node join(const Node& left, const Node& right, const NodeLayout& layout = {});

/// The XXH3-128 of a node: its range, its count of non-finite samples and its values, as little-endian bytes.
Hash128 hash_of(const Node& node);

}  // namespace lightmill
