// Photons that the camera sees directly, by the pixels that they fall into.
#pragma once

#include <span>
#include <vector>

#include "common/film/tile_grid.h"
#include "common/methods/photons/photon.h"
#include "common/scene/compiled/compiled_scene.h"

namespace lightmill::photons {

/// One photon in one pixel of the full film. Whether it is visible, and what it contributes, is found when the pixel is
/// rendered.
struct Splat {
  std::uint32_t photon = 0;
  std::int32_t x = 0, y = 0;
  float weight = 1;  ///< of the filter, over the probability of this pixel
  Vec3 eye{0};       ///< the point of the lens that sees it
};

/// Splats of a pass by the full film's tiles, in the order of the photons. The filter's weights around a photon's film
/// position draw its pixel, for x and for y. Immutable.
class FilmSplats {
 public:
  FilmSplats() = default;
  /// `seed`: of the pass.
  FilmSplats(const CompiledScene& scene, std::span<const Photon> photons, std::uint32_t seed);

  /// Appends those in the rectangle. Those of one pixel have one order, whatever the rectangle.
  void find(const PixelRect& rect, std::vector<const Splat*>& out) const;
  std::uint64_t bytes() const { return splats_.size() * sizeof(Splat) + first_.size() * 4; }

 private:
  int columns_ = 0, rows_ = 0;
  std::vector<std::uint32_t> first_;  ///< by tile, and the end
  std::vector<Splat> splats_;
};

}  // namespace lightmill::photons
