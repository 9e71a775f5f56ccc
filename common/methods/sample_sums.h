// Pairwise sums of one tile's samples: builds a node from single samples by the film's tree.
#pragma once

#include <span>
#include <vector>

#include "common/film/node.h"

namespace lightmill {

/// Takes the samples of a range in ascending order and gives the node.
class SampleSums {
 public:
  /// Starts a node of `range` for `pixels` pixels.
  void start(SampleRange range, std::size_t pixels, const NodeLayout& layout = {});
  /// The next sample: planes ([channel][pixel]) of the summed channels, beauty first; below sample 16 also those of the
  /// other layers, in NodeLayout's order. Where beauty is not finite, or so large (1e29) that sums could become
  /// infinite, all of the pixel's values become zero and the sample is counted; other values that are not finite become
  /// zero.
  void add(std::span<float> planes, std::span<float> first = {});
  /// After range.count() samples.
  Node finish();

 private:
  /// Complete subtrees of one half, waiting for their siblings: partial[l] holds 2^l samples.
  struct Half {
    std::vector<std::vector<float>> partial;
    std::uint64_t count = 0;
  };
  void push(Half& half, std::span<const float> planes);
  /// The first-sample values of `count` samples from first_[begin] on, by the tree.
  std::vector<float> first_tree(std::size_t begin, std::size_t count) const;

  SampleRange range_;
  std::size_t pixels_ = 0;
  NodeLayout layout_;
  std::uint64_t next_ = 0;
  std::uint64_t non_finite_ = 0;
  std::array<Half, 2> halves_;
  std::vector<std::vector<float>> first_;  ///< one entry a sample
};

}  // namespace lightmill
