// Film: for each tile, the forest of nodes merged so far.
//
// Pure and not thread-safe. The bits of a tile's sums depend only on the merged sample ranges. Order of arrival and
// size of pieces do not affect them.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "common/film/film_outline.h"

namespace lightmill {

using NodePtr = std::shared_ptr<const Node>;

/// Result of merging a node.
struct MergeOutcome {
  enum class Kind {
    merged,     ///< it entered the film
    duplicate,  ///< its range was covered already: dropped
    mismatch,   ///< the same range was merged before with other bits: dropped
  };
  Kind kind = Kind::merged;
  /// Nodes that left the forest (joined with their sibling, or replaced by an ancestor), and nodes that joined it.
  /// Nodes that did both in this merge are in neither list.
  std::vector<SampleRange> removed;
  std::vector<NodePtr> added;
};

/// Siblings are joined as soon as both have arrived. So a tile's forest is the shortest list of dyadic ranges that
/// covers its samples. Descendants that fill a range are always joined to it.
class Film : public FilmOutline {
 public:
  Film(const TileGrid& grid, const NodeLayout& layout, Allocation allocation = {});
  /// The film of this outline. `nodes` must be those of the outline (checked), by tile, ascending.
  Film(FilmOutline outline, std::vector<std::vector<NodePtr>> nodes);

  /// Merges a node. Its values must have the right size (see expected_values).
  MergeOutcome merge(TileId tile, NodePtr node);
  /// Removes the node of exactly this range, which must be in the forest (checked).
  void drop(TileId tile, SampleRange range);
  /// Restores a stored node. Stored nodes must not overlap.
  void restore(TileId tile, NodePtr node);

  const std::vector<NodePtr>& forest(TileId tile) const;  ///< ascending, disjoint, maximal
  /// sums_over of beauty.
  std::vector<float> beauty_sums(TileId tile) const;
  /// sums_over of the layer `bias`; empty if there is none.
  std::vector<float> bias_sums(TileId tile) const;
  /// Whether anything else refers to a node, so that deleting the film would not free its memory.
  bool shared() const;

 private:
  std::vector<std::vector<NodePtr>> forests_;  ///< by tile
};

/// The sums over a forest, in ascending index order, of `channels` of the `layout.summed` channels, laid out as
/// Node::values with this number of channels. All zero for an empty forest.
std::vector<float> sums_over(const std::vector<NodePtr>& forest, const NodeLayout& layout, std::size_t pixels,
                             std::uint32_t channels, std::uint32_t first_channel = 0);

/// The values in a forest of the layers that are not summed.
struct FirstValues {
  std::uint32_t samples = 0;  ///< number of samples in the forest, of samples 0 to 15
  std::vector<float> values;  ///< laid out as in NodeLayout
};
FirstValues first_over(const std::vector<NodePtr>& forest, const NodeLayout& layout, std::size_t pixels);

}  // namespace lightmill
