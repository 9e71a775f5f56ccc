// The denoised picture of a film, tile by tile, for the page.
#pragma once

#include <string>
#include <vector>

#include "common/film/layers.h"
#include "server/assembly/tile_snapshot.h"

namespace lightmill {

/// Limit of a denoised picture's pixels. It takes half a gibibyte, and three seconds of a core.
inline constexpr std::int64_t kMaxDenoisedPixels = std::int64_t{1} << 21;

/// All tiles of a film that has the layer `features`.
struct FilmToDenoise {
  PixelRect crop;
  LayerSlice features;  ///< the layer's place
  std::vector<TileSnapshot> tiles;
};

/// A tile of a denoised picture.
struct DenoisedTile {
  PixelRect rect;
  std::uint64_t samples = 0;  ///< per pixel
  std::string pixels;         ///< as view_pixels gives them; E is −1, because the error is unknown
};

/// The tiles in their order, with the bits of `reconstruct` (common/film/reconstruct.h). Takes about 250 bytes a pixel,
/// and 1.5 s of a core per megapixel.
std::vector<DenoisedTile> denoised_tiles(const FilmToDenoise& film);

}  // namespace lightmill
