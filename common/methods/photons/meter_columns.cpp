#include "common/methods/photons/meter_columns.h"

#include <numeric>

namespace lightmill::photons {

void MeterColumns::finish_sample(tracer::Wavefront& wavefront) {
  const PixelRect& tile = wavefront.tile();
  const Vec3d all = std::accumulate(brought_.begin(), brought_.end(), Vec3d(0));
  const auto pixels = static_cast<std::uint32_t>(tile.pixel_count());
  for (std::uint32_t pixel = 0; pixel < pixels; ++pixel) {
    const auto column = static_cast<std::size_t>(tile.x) + pixel % static_cast<std::uint32_t>(tile.width);
    const Vec3 difference((brought_.at(column) * double{kTileSize} - all) / static_cast<double>(pixels));
    wavefront.add_to_layer(0, first_lanes(1), U8(pixel), broadcast(difference));
  }
  brought_ = {};
}

}  // namespace lightmill::photons
