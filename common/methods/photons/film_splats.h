// Where on the film deposits are seen directly.
#pragma once

#include <span>
#include <vector>

#include "common/film/tile_grid.h"
#include "common/methods/photons/deposit.h"
#include "common/scene/compiled/compiled_scene.h"

namespace lightmill::photons {

/// One deposit in one pixel of the full film. Whether it is seen, and what it then brings, is left to who renders the
/// pixel.
struct Splat {
  std::uint32_t deposit = 0;
  std::int32_t x = 0, y = 0;
  float weight = 1;  ///< of the filter, over the probability of this pixel
  Vec3 eye{0};       ///< the point of the lens that it is seen from
};

/// The splats of a pass by the full film's tiles, in the order of the deposits. A pixel near the place where a deposit
/// lies on the film is drawn by the filter's weight there, for x and for y. Immutable.
class FilmSplats {
 public:
  FilmSplats() = default;
  /// `seed`: of the pass.
  FilmSplats(const CompiledScene& scene, std::span<const Deposit> deposits, std::uint32_t seed);

  /// Appends those in the rectangle; a pixel's come in one order whatever the rectangle.
  void find(const PixelRect& rect, std::vector<const Splat*>& out) const;
  std::uint64_t bytes() const { return splats_.size() * sizeof(Splat) + first_.size() * 4; }

 private:
  int columns_ = 0, rows_ = 0;
  std::vector<std::uint32_t> first_;  ///< by tile, and the end
  std::vector<Splat> splats_;
};

}  // namespace lightmill::photons
