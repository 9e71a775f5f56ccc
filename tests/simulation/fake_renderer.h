// Fake renderer. A sample is a hash of the render digest, the tile, the sample index, and the machine's rounding. Samples
// are summed like real ones.
#pragma once

#include <map>
#include <tuple>

#include "common/film/film.h"

namespace lightmill::simulation {

class FakeRenderer {
 public:
  /// Node of a tile of `pixels` pixels. `rounds_up` replaces each value of a sample by the next larger one.
  NodePtr node(const Sha256& digest, TileId tile, SampleRange range, std::size_t pixels, const NodeLayout& layout,
               bool rounds_up = false);
  /// Samples [0, samples) as a film must have them: in maximal dyadic ranges, ascending.
  std::vector<NodePtr> forest(const Sha256& digest, TileId tile, std::uint64_t samples, std::size_t pixels,
                              const NodeLayout& layout);
  /// Drops cached nodes if there are many. Each of millions of schedules adds a few.
  void trim();

 private:
  std::map<std::tuple<Sha256, TileId, SampleRange, bool>, NodePtr>
      nodes_;  ///< cache: many schedules ask for the same nodes
};

/// Renderer that all simulations of a thread share. It caches its nodes.
FakeRenderer& shared_renderer();

}  // namespace lightmill::simulation
