// Noise of a picture by tile, from a few samples of one method, to divide samples among tiles.
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
  std::string method;      ///< with parameters
  std::uint64_t seed = 0;  ///< the job's; the samples derive another, so that they never enter a film
  std::uint32_t max_bounces = 0;
  TileGrid grid;
  std::int64_t most_pixels = 1 << 16;  ///< of all patches, apart from one per tile
};

/// Allocation from noise_patches of every tile, with 16 samples per pixel. This is as much work as one sample of the
/// picture, and at most as one sample of 1024×1024 pixels. Larger pictures are measured by region. A region has as many
/// patches as a tile of a 1024×1024 picture, because fewer tell too little.
///
/// Renders on the calling thread. A pure function of its arguments. Meters' tiles keep the mean count. INVALID_ARGUMENT
/// if the method cannot be made. CANCELLED if stopped, which is checked between bounces.
Result<AllocationResult> find_allocation(const std::shared_ptr<const CompiledScene>& scene,
                                         const TileNoiseSettings& settings, const std::stop_token& stop = {});

/// 8 pixels, so that no edge lies between patches. For a large film, the smallest power of two at which all patches
/// have at most `most_pixels`.
int noise_cell_side(const PixelRect& film, std::int64_t most_pixels);
/// 2×2 pixels in the middle of each cell of a tile; at least one patch.
std::vector<PixelRect> noise_patches(const PixelRect& tile, int cell_side);

/// The result in words.
std::string describe(const AllocationResult& result);

}  // namespace lightmill
