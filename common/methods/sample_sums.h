// Pairwise sums of one tile's samples: adds single samples to a node by the film's binary tree.
#pragma once

#include <span>
#include <vector>

#include "common/film/node.h"

namespace lightmill {

/// Takes the samples of a range in ascending order and returns the node. Not thread-safe.
class SampleSums {
 public:
  /// Starts a node of `range` for `pixels` pixels.
  void start(SampleRange range, std::size_t pixels, const NodeLayout& layout = {});
  /// Adds the next sample. `planes` ([channel][pixel]) are the summed channels, beauty first. `first` are the other
  /// layers in NodeLayout's order, for samples below 16.
  ///
  /// Beauty that is not finite, or so large (1e29) that sums could become infinite, makes all of the pixel's values
  /// zero, and the sample is counted. Other values that are not finite become zero.
  void add(std::span<float> planes, std::span<float> first = {});
  /// Returns the node, after range.count() samples.
  Node finish();

 private:
  /// Complete subtrees of one half that lack their siblings. partial[l] has 2^l samples.
  struct Half {
    std::vector<std::vector<float>> partial;
    std::uint64_t count = 0;
  };
  void push(Half& half, std::span<const float> planes);
  /// First-sample values of `count` samples from first_[begin] on, joined by the tree.
  std::vector<float> first_tree(std::size_t begin, std::size_t count) const;

  SampleRange range_;
  std::size_t pixels_ = 0;
  NodeLayout layout_;
  std::uint64_t next_ = 0;
  std::uint64_t non_finite_ = 0;
  std::array<Half, 2> halves_;
  std::vector<std::vector<float>> first_;  ///< one entry per sample
};

}  // namespace lightmill
