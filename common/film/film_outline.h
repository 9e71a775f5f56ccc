// Outline of a film: the nodes in each tile's forest, without their values.
//
// Pure and not thread-safe. It counts samples also when the values are not in memory.
#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include "common/base/ids.h"
#include "common/film/allocation.h"
#include "common/film/node.h"
#include "common/film/tile_grid.h"

namespace lightmill {

/// A node without its values.
struct NodeOutline {
  SampleRange range;
  std::uint64_t non_finite = 0;
  std::uint64_t values = 0;  ///< number of values
  friend bool operator==(const NodeOutline&, const NodeOutline&) = default;
};
NodeOutline outline_of(const Node& node);

class FilmOutline {
 public:
  FilmOutline(const TileGrid& grid, const NodeLayout& layout, Allocation allocation = {});

  const TileGrid& grid() const { return grid_; }
  const NodeLayout& layout() const { return layout_; }
  const Allocation& allocation() const { return allocation_; }

  /// Removes the node of exactly this range, which must be in the forest (checked).
  void drop(TileId tile, SampleRange range);
  /// Restores a stored node. Stored nodes must not overlap.
  void restore(TileId tile, const NodeOutline& node);

  std::size_t expected_values(TileId tile, SampleRange range) const;  ///< of a node
  std::uint64_t samples(TileId tile) const;                           ///< merged so far, per pixel
  bool covered(TileId tile, SampleRange range) const;                 ///< whether find() finds a node
  std::uint64_t non_finite() const { return non_finite_; }
  std::uint64_t bytes() const { return bytes_; }                  ///< of the nodes' values
  const std::vector<NodeOutline>& nodes(TileId tile) const;       ///< ascending, disjoint, maximal
  const NodeOutline* find(TileId tile, SampleRange range) const;  ///< the node that contains the range, or null
  /// Samples in half A and in half B.
  struct HalfCounts {
    std::uint64_t a = 0, b = 0;
  };
  HalfCounts half_counts(TileId tile) const;
  std::uint64_t version(TileId tile) const;           ///< increases with every merge into the tile
  std::uint64_t version() const { return version_; }  ///< increases with every merge

  // Over all tiles; O(1).
  /// Per pixel, of the tile with the fewest.
  std::uint64_t min_samples() const { return tiles_by_samples_.begin()->first; }
  /// Per pixel, of the tile with the most.
  std::uint64_t max_samples() const { return tiles_by_samples_.rbegin()->first; }
  /// Sum over the pixels.
  std::uint64_t pixel_samples() const { return pixel_samples_; }
  /// The largest frame count whose share (Allocation) every tile has. O(1).
  std::uint64_t frame_samples() const { return tiles_by_frame_samples_.begin()->first; }
  /// Mean pixel samples per sample of the frame, if no tile's share is rounded.
  double mean_share() const { return mean_share_; }
  /// Pixel samples of the film at this frame count.
  std::uint64_t pixel_samples_at(std::uint64_t frame_samples) const;
  /// Whether every tile has exactly its share of this frame count. O(1) if the frame has another count.
  bool has_exactly(std::uint64_t frame_samples) const;

 protected:
  /// Position of the first node that ends after sample `first`.
  std::size_t first_ending_after(TileId tile, std::uint64_t first) const;
  /// Replaces the nodes [begin, end) by `node`.
  void replace(TileId tile, std::size_t begin, std::size_t end, const NodeOutline& node);

 private:
  struct Tile {
    std::vector<NodeOutline> nodes;
    std::uint64_t samples = 0;
    std::uint64_t version = 0;
  };
  using TilesByCount = std::map<std::uint64_t, std::uint32_t>;  ///< number of tiles by sample count
  const Tile& tile_at(TileId tile) const;
  /// Adds a node to the counts, or subtracts it.
  void count(Tile& tile, const NodeOutline& node, bool added);
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

}  // namespace lightmill
