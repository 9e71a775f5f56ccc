// The film: per tile, the forest of nodes merged so far, and what can be read from it.
//
// Pure and not thread-safe. The bits of a tile's sums are a function of the merged sample ranges alone, never of the
// order in which they came or of how they were cut.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "common/film/film_outline.h"

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
class Film : public FilmOutline {
 public:
  Film(const TileGrid& grid, const NodeLayout& layout, Allocation allocation = {});
  /// The film of this outline, with just its nodes (checked); `nodes` by tile, ascending.
  Film(FilmOutline outline, std::vector<std::vector<NodePtr>> nodes);

  /// Merges a node whose values have the right size (see expected_values).
  MergeOutcome merge(TileId tile, NodePtr node);
  /// Takes out the node of exactly this range, which is in the forest (checked).
  void drop(TileId tile, SampleRange range);
  /// Puts back a stored node; the stored forest has no two that overlap.
  void restore(TileId tile, NodePtr node);

  const std::vector<NodePtr>& forest(TileId tile) const;  ///< ascending, disjoint, maximal
  /// The sum over the forest in ascending index order of the summed channels, laid out as in Node::values; all zero
  /// while empty.
  std::vector<float> sums(TileId tile) const;
  /// The same of beauty alone.
  std::vector<float> beauty_sums(TileId tile) const;
  /// The same of the layer `bias`; empty if there is none.
  std::vector<float> bias_sums(TileId tile) const;
  /// Whether somebody else holds a node, too: without the film, its memory would not be free.
  bool shared() const;

 private:
  std::vector<std::vector<NodePtr>> forests_;  ///< by tile
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
