// The film: per tile, the forest of nodes merged so far, and what can be read from it.
//
// Pure and not thread-safe. The bits of a tile's sums are a function of the merged sample ranges alone, never of the
// order in which they came or of how they were cut.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <vector>

#include "common/base/ids.h"
#include "common/film/allocation.h"
#include "common/film/node.h"
#include "common/film/tile_grid.h"

namespace lightmill {

using NodePtr = std::shared_ptr<const Node>;

/// What merging a node did.
struct MergeOutcome {
  enum class Kind {
    merged,     ///< it entered the film
    duplicate,  ///< its range was covered already: dropped
    mismatch,   ///< an equal range was merged before with other bits: dropped
  };
  Kind kind = Kind::merged;
  /// Nodes that left the forest (joined with their sibling, or replaced by an ancestor) and those that joined it. What
  /// was both added and removed by the same merge is in neither.
  std::vector<SampleRange> removed;
  std::vector<NodePtr> added;
};

/// Siblings are joined as soon as both are in, so a tile's forest is always the shortest list of dyadic ranges that
/// covers what was merged, and descendants never fill a range without being joined to it.
class Film {
 public:
  Film(const TileGrid& grid, const NodeLayout& layout, Allocation allocation = {});

  const TileGrid& grid() const { return grid_; }
  const NodeLayout& layout() const { return layout_; }
  const Allocation& allocation() const { return allocation_; }

  /// Merges a node whose values have the right size (see expected_values).
  MergeOutcome merge(TileId tile, NodePtr node);
  /// Takes out the node of exactly this range, which is in the forest (checked).
  void drop(TileId tile, SampleRange range);
  /// Puts back a stored node; the stored forest has no two that overlap.
  void restore(TileId tile, NodePtr node);

  std::size_t expected_values(TileId tile, SampleRange range) const;  ///< of a node
  std::uint64_t samples(TileId tile) const;                           ///< per pixel, merged so far
  bool covered(TileId tile, SampleRange range) const;  ///< by itself or an ancestor (hence also: filled by descendants)
  std::uint64_t non_finite() const { return non_finite_; }
  std::uint64_t bytes() const { return bytes_; }          ///< held by nodes' values
  const std::vector<NodePtr>& forest(TileId tile) const;  ///< ascending, disjoint, maximal
  /// The sum over the forest in ascending index order of the summed channels, laid out as in Node::values; all zero
  /// while empty.
  std::vector<float> sums(TileId tile) const;
  /// The same of beauty alone.
  std::vector<float> beauty_sums(TileId tile) const;
  /// The same of the layer `bias`; empty if there is none.
  std::vector<float> bias_sums(TileId tile) const;
  /// Samples in half A and in half B.
  struct HalfCounts {
    std::uint64_t a = 0, b = 0;
  };
  HalfCounts half_counts(TileId tile) const;
  std::uint64_t version(TileId tile) const;           ///< grows with every merge into the tile
  std::uint64_t version() const { return version_; }  ///< grows with every merge

  // Over all tiles; O(1).
  std::uint64_t min_samples() const { return tiles_by_samples_.begin()->first; }   ///< per pixel, least sampled tile
  std::uint64_t max_samples() const { return tiles_by_samples_.rbegin()->first; }  ///< per pixel, most sampled tile
  std::uint64_t pixel_samples() const { return pixel_samples_; }                   ///< sum over pixels
  /// The most samples of the frame of which every tile has its part (Allocation); O(1).
  std::uint64_t frame_samples() const { return tiles_by_frame_samples_.begin()->first; }
  /// Pixel samples, as a mean over pixels, that one of the frame's stands for where no tile's part is rounded.
  double mean_share() const { return mean_share_; }
  /// Pixel samples of so many of the frame.
  std::uint64_t pixel_samples_at(std::uint64_t frame_samples) const;
  /// Whether every tile has just its part of so many; O(1) where the frame has another count.
  bool has_just(std::uint64_t frame_samples) const;

 private:
  struct Tile {
    std::vector<NodePtr> forest;
    std::uint64_t samples = 0;
    std::uint64_t version = 0;
  };
  using TilesByCount = std::map<std::uint64_t, std::uint32_t>;  ///< how many tiles have so many
  const Tile& tile_at(TileId tile) const;
  void account(TileId tile, std::uint64_t samples_before);
  static void recount(TilesByCount& tiles, std::uint64_t from, std::uint64_t to);

  TileGrid grid_;
  NodeLayout layout_;
  Allocation allocation_;
  double mean_share_ = 1;
  std::vector<Tile> tiles_;
  TilesByCount tiles_by_samples_, tiles_by_frame_samples_;
  std::uint64_t pixel_samples_ = 0;
  std::uint64_t non_finite_ = 0;
  std::uint64_t bytes_ = 0;
  std::uint64_t version_ = 0;
};

/// The sums over a forest in ascending index order of `channels` of `layout.summed` channels, laid out as in
/// Node::values with so many channels; all zero while empty.
std::vector<float> sums_over(const std::vector<NodePtr>& forest, const NodeLayout& layout, std::size_t pixels,
                             std::uint32_t channels, std::uint32_t first_channel = 0);

/// What a forest holds of the layers that are not summed.
struct FirstValues {
  std::uint32_t samples = 0;  ///< of samples 0 to 15, how many are in
  std::vector<float> values;  ///< laid out as NodeLayout says
};
FirstValues first_over(const std::vector<NodePtr>& forest, const NodeLayout& layout, std::size_t pixels);

}  // namespace lightmill
