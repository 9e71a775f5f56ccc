// A renderer whose samples are a hash: a pure function of (render digest, tile, sample index) and of how the machine
// rounds, summed as real ones are.
#pragma once

#include <map>
#include <tuple>

#include "common/film/film.h"

namespace lightmill::simulation {

class FakeRenderer {
 public:
  /// The node of a tile of `pixels` pixels; `rounds_up` makes each value of a sample the next larger one.
  NodePtr node(const Sha256& digest, TileId tile, SampleRange range, std::size_t pixels, const NodeLayout& layout,
               bool rounds_up = false);
  /// Samples [0, samples) as a film must hold them: over maximal dyadic ranges, ascending.
  std::vector<NodePtr> forest(const Sha256& digest, TileId tile, std::uint64_t samples, std::size_t pixels,
                              const NodeLayout& layout);
  /// Lets go of what was rendered before, if it is much. Every schedule of millions remembers a little.
  void trim();

 private:
  std::map<std::tuple<Sha256, TileId, SampleRange, bool>, NodePtr>
      nodes_;  ///< rendered before; many schedules ask for the same
};

/// Renderer that all simulations of a thread share. It keeps what it has rendered.
FakeRenderer& shared_renderer();

}  // namespace lightmill::simulation
