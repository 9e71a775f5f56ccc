// Directly visible photons, sorted by tile and drawn into pixels.
#pragma once

#include <span>
#include <vector>

#include "common/film/tile_grid.h"
#include "common/methods/photons/photon.h"
#include "common/scene/compiled/compiled_scene.h"

namespace lightmill::photons {

/// One photon in one pixel of the full film. Its visibility and contribution are computed when the pixel is rendered.
struct Splat {
  std::uint32_t photon = 0;
  std::int32_t x = 0, y = 0;
  float weight = 1;    ///< filter value over the probability of this pixel
  Vec3 lens_point{0};  ///< point of the lens that sees it
};

/// Splats of a pass by tile of the full film, in photon order. For x and for y, the filter's weights around a photon's
/// film position draw the pixel. Immutable.
class FilmSplats {
 public:
  FilmSplats() = default;
  /// `seed`: the pass's.
  FilmSplats(const CompiledScene& scene, std::span<const Photon> photons, std::uint32_t seed);

  /// Appends the splats in the rectangle. The order within a pixel does not depend on the rectangle.
  void find(const PixelRect& rect, std::vector<const Splat*>& out) const;
  std::uint64_t bytes() const { return splats_.size() * sizeof(Splat) + first_.size() * 4; }

 private:
  int columns_ = 0, rows_ = 0;
  std::vector<std::uint32_t> first_;  ///< first splat by tile, and the end
  std::vector<Splat> splats_;
};

}  // namespace lightmill::photons
