#include "server/assembly/tile_snapshot.h"

namespace lightmill {

TileSnapshot snapshot(const Film& film, TileId tile) {
  return {film.grid().tile_rect(tile), film.layout(), film.samples(tile), film.half_counts(tile).a, film.forest(tile)};
}

std::vector<float> sums_of(const TileSnapshot& tile) {
  return sums_over(tile.forest, tile.layout, static_cast<std::size_t>(tile.rect.pixel_count()), tile.layout.summed);
}

FirstValues first_of(const TileSnapshot& tile) {
  return first_over(tile.forest, tile.layout, static_cast<std::size_t>(tile.rect.pixel_count()));
}

std::vector<float> mean_rgb(const TileSnapshot& tile) {
  const auto pixels = static_cast<std::size_t>(tile.rect.pixel_count());
  std::vector<float> sums = sums_over(tile.forest, tile.layout, pixels, kBeautyChannels);
  const float scale = tile.samples > 0 ? 1.0f / static_cast<float>(tile.samples) : 0.0f;
  const std::size_t half = kBeautyChannels * pixels;
  for (std::size_t i = 0; i < half; ++i) {
    sums[i] = (sums[i] + sums[half + i]) * scale;
  }
  sums.resize(half);
  return sums;
}

}  // namespace lightmill
