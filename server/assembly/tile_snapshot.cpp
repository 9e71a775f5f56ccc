#include "server/assembly/tile_snapshot.h"

#include "common/base/check.h"

namespace lightmill {

TileSnapshot snapshot(const Film& film, TileId tile) {
  return {film.grid().tile_rect(tile), film.channels(), film.samples(tile), film.half_counts(tile).a, film.forest(tile)};
}

std::vector<float> sums_of(const TileSnapshot& tile) {
  std::vector<float> sums(std::size_t{2} * tile.channels * static_cast<std::size_t>(tile.rect.pixel_count()));
  bool first = true;
  for (const std::shared_ptr<const Node>& node : tile.forest) {
    LM_CHECK(node->values.size() == sums.size());
    for (std::size_t i = 0; i < sums.size(); ++i) {
      sums[i] = first ? node->values[i] : sums[i] + node->values[i];
    }
    first = false;
  }
  return sums;
}

std::vector<float> mean_rgb(const TileSnapshot& tile) {
  LM_CHECK(tile.channels >= kBeautyChannels);
  const auto pixels = static_cast<std::size_t>(tile.rect.pixel_count());
  std::vector<float> sums = sums_of(tile);
  const float scale = tile.samples > 0 ? 1.0f / static_cast<float>(tile.samples) : 0.0f;
  const std::size_t half_b = tile.channels * pixels;
  for (std::size_t i = 0; i < kBeautyChannels * pixels; ++i) {
    sums[i] = (sums[i] + sums[half_b + i]) * scale;
  }
  sums.resize(kBeautyChannels * pixels);
  return sums;
}

}  // namespace lightmill
