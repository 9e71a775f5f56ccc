// Where the noise of a picture is: a few samples by one method all over it, to find out how many each tile is to get.
#pragma once

#include <memory>
#include <stop_token>
#include <string>
#include <vector>

#include "common/base/status.h"
#include "common/film/allocation.h"
#include "common/film/tile_grid.h"
#include "common/scene/compiled/compiled_scene.h"

namespace lightmill {

struct TileNoiseSettings {
  std::string method;      ///< with its parameters
  std::uint64_t seed = 0;  ///< of the job; the samples' own numbers are others, so that they never enter a film
  std::uint32_t max_bounces = 0;
  TileGrid grid;
  std::int64_t most_pixels = 1 << 16;  ///< of all patches, but for one a tile
};

/// What noise_patches of every tile say, 16 samples a pixel: as much work as one sample of all of the picture, and no
/// more than that of one of 1024×1024 pixels. Larger ones are looked at by regions of as many tiles as such a picture
/// would have one of: few patches say too little of a tile. Renders on the calling thread; a pure function of its
/// arguments. Meters' tiles have their part of all. INVALID_ARGUMENT if the method cannot be made; CANCELLED if it was
/// stopped, which it does between bounces.
Result<Gain> find_allocation(const std::shared_ptr<const CompiledScene>& scene, const TileNoiseSettings& settings,
                             const std::stop_token& stop = {});

/// 8 pixels, so close that no edge runs between patches, or for a large film the least power of two at which all
/// patches have no more than `most_pixels`.
int noise_cell_side(const PixelRect& film, std::int64_t most_pixels);
/// 2×2 pixels in the middle of every cell of a tile, and at least one such patch.
std::vector<PixelRect> noise_patches(const PixelRect& tile, int cell_side);

/// In words: what was found.
std::string describe(const Gain& gain);

}  // namespace lightmill
