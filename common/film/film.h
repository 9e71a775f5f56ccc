// The film: per tile, the forest of nodes merged so far, and what can be read from it.
//
// Pure and not thread-safe. The bits of a tile's sums are a function of the merged sample ranges alone, never of the order in
// which they came or of how they were cut.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "common/base/ids.h"
#include "common/film/node.h"
#include "common/film/tile_grid.h"

namespace lightmill {

/// What merging a node did.
struct MergeOutcome {
  enum class Kind {
    merged,     ///< it entered the film
    duplicate,  ///< its range was covered already: dropped
    mismatch,   ///< an equal range was merged before with other bits, or merged descendants that fill it differ: dropped
  };
  Kind kind = Kind::merged;
  /// Nodes that left the forest (joined with their sibling, or replaced by an ancestor) and those that joined it. What was
  /// both added and removed by the same merge is in neither.
  std::vector<SampleRange> removed;
  std::vector<std::shared_ptr<const Node>> added;
};

class Film {
 public:
  Film(const TileGrid& grid, std::uint32_t channels);

  const TileGrid& grid() const { return grid_; }
  std::uint32_t channels() const { return channels_; }

  /// Merges a node whose values have the right size (see expected_values).
  MergeOutcome merge(TileId tile, std::shared_ptr<const Node> node);
  /// Puts back a stored node; the stored forest has no two that overlap.
  void restore(TileId tile, std::shared_ptr<const Node> node);

  std::size_t expected_values(TileId tile) const;       ///< 2 * channels * pixels
  std::uint64_t samples(TileId tile) const;             ///< per pixel, merged so far
  bool covered(TileId tile, SampleRange range) const;   ///< by itself or an ancestor, or completely by descendants
  std::uint64_t non_finite() const;
  std::uint64_t bytes() const;                          ///< held by nodes
  const std::vector<std::shared_ptr<const Node>>& forest(TileId tile) const;  ///< ascending, disjoint, maximal
  /// The sum over the forest in ascending index order, laid out as Node::values; all zero while empty.
  std::vector<float> sums(TileId tile) const;
  /// Samples in half A and in half B.
  struct HalfCounts {
    std::uint64_t a = 0, b = 0;
  };
  HalfCounts half_counts(TileId tile) const;
  std::uint64_t version(TileId tile) const;             ///< grows with every merge into the tile

 private:
  struct Tile {
    std::vector<std::shared_ptr<const Node>> forest;
    std::uint64_t version = 0;
  };
  TileGrid grid_;
  std::uint32_t channels_ = 0;
  std::vector<Tile> tiles_;
};

}  // namespace lightmill
