// Pairwise sums of one tile's samples: builds a node from single samples by the film's tree.
#pragma once

#include <span>
#include <vector>

#include "common/film/node.h"

namespace lightmill {

/// Takes the samples of a range in ascending order, one frame of 3·pixels values each, and gives the node.
class SampleSums {
 public:
  /// Starts a node of `range` for `pixels` pixels.
  void start(SampleRange range, std::size_t pixels);
  /// The next sample: RGB planes ([channel][pixel]). Values that are not finite, or so large (1e29) that sums could
  /// become infinite, become zero for the whole pixel and are counted.
  void add(std::span<float> planes);
  /// After range.count() samples.
  Node finish();

 private:
  /// Complete subtrees of one half, waiting for their siblings: partial[l] holds 2^l samples.
  struct Half {
    std::vector<std::vector<float>> partial;
    std::uint64_t count = 0;
  };
  void push(Half& half, std::span<const float> planes);

  SampleRange range_;
  std::size_t pixels_ = 0;
  std::uint64_t next_ = 0;
  std::uint64_t non_finite_ = 0;
  std::array<Half, 2> halves_;
};

}  // namespace lightmill
